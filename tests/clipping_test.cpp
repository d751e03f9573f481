// Triangles that share an edge must be cut at the same place, to the bit, or surfaces come apart along clip planes.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "passes/raster.hpp"
#include "test_scene.hpp"

namespace parian::test {
namespace {

using Corner = std::pair<int, int>;

/// The part of a-b (view coordinates) before the near plane and inside the guard band, as film positions in 1/256.
std::vector<glm::dvec2> clipped_ends(const kernels::View& view, glm::dvec3 a, glm::dvec3 b) {
  const double guard = 32768.0 / view.scale;
  const auto distances = [&](glm::dvec3 c) {
    return std::array<double, 5>{-c.z - view.near_distance, -guard * c.z - c.x, -guard * c.z + c.x, -guard * c.z - c.y,
                                 -guard * c.z + c.y};
  };
  double first = 0, last = 1;
  const auto at_a = distances(a), at_b = distances(b);
  for (std::size_t k = 0; k < 5; ++k) {
    if (at_a[k] < 0 && at_b[k] < 0) return {};
    const double t = at_a[k] / (at_a[k] - at_b[k]);
    if (at_a[k] < 0) first = std::max(first, t);
    if (at_b[k] < 0) last = std::min(last, t);
  }
  if (last - first < 1e-3) return {};
  std::vector<glm::dvec2> ends;
  for (const double t : {first, last}) {
    const glm::dvec3 c = a + (b - a) * t;
    ends.push_back(256.0 * glm::dvec2(view.centre_x - view.scale * c.x / c.z, view.centre_y - view.scale * c.y / c.z));
  }
  return ends;
}

TEST(Clipping, TrianglesThatShareAnEdgeAreCutAtTheSamePlace) {
  Settings settings;
  settings.keep = {"clipping"};
  Bench b(scene_of(icosphere(1)), settings, [](Plan& p) { p.space = {glm::dvec3(0), 1.0}; });
  // Both triangles of each edge, by the edge's ends.
  std::map<std::array<double, 6>, std::vector<std::uint32_t>> edges;
  for (std::uint32_t t = 0; t < b.scene.mesh.triangles.size(); ++t)
    for (int c = 0; c < 3; ++c) {
      std::array<double, 3> p, q;
      for (int i = 0; i < 3; ++i) p[i] = b.corner(t, c)[i], q[i] = b.corner(t, (c + 1) % 3)[i];
      if (q < p) std::swap(p, q);
      edges[{p[0], p[1], p[2], q[0], q[1], q[2]}].push_back(t);
    }
  Random random(8);
  std::size_t compared = 0, cut = 0, different = 0;
  for (int i = 0; i < fitted(150, 70); ++i) {
    const glm::dvec3 eye = 0.7 * random.direction();
    const kernels::View view =
        pinhole_view({eye, eye + random.direction(), random.direction(), random(30, 110)}, b.plan.space, {300, 200});
    setup_view(b.passes, view, Stage::layers);
    const auto records =
        b.compute.read<kernels::RasterTriangle>(b.passes.geometry.records, b.passes.geometry.n_records);
    std::vector<std::vector<Corner>> corners(b.scene.mesh.triangles.size());
    for (const kernels::RasterTriangle& r : records)
      if (r.triangle != 0xffffffffU)
        for (const Corner& c : {Corner{r.x0, r.y0}, Corner{r.x1, r.y1}, Corner{r.x2, r.y2}})
          corners[r.triangle].push_back(c);
    const ExactView exact_view(view);
    for (const auto& [e, triangles] : edges) {
      ASSERT_EQ(triangles.size(), 2U);
      if (corners[triangles[0]].empty() || corners[triangles[1]].empty()) continue;
      const glm::dvec3 p = exact_view.frame(glm::dvec3(e[0], e[1], e[2]) - exact_view.origin);
      const glm::dvec3 q = exact_view.frame(glm::dvec3(e[3], e[4], e[5]) - exact_view.origin);
      for (const glm::dvec2 end : clipped_ends(view, p, q)) {
        const auto nearest = [&](std::uint32_t t) {
          return *std::min_element(corners[t].begin(), corners[t].end(), [&](const Corner& u, const Corner& v) {
            return std::hypot(u.first - end.x, u.second - end.y) < std::hypot(v.first - end.x, v.second - end.y);
          });
        };
        const Corner one = nearest(triangles[0]), two = nearest(triangles[1]);
        // Float32 projects an end in the guard band with an error of some 1e-5 of its distance.
        if (std::hypot(one.first - end.x, one.second - end.y) > 64 + 1e-4 * glm::length(end)) continue;
        ++compared;
        cut += glm::length(end) > 8e6;
        if (one == two) continue;
        if (++different <= 3)
          ADD_FAILURE() << fmt::format("triangles {} and {}: ({}, {}) and ({}, {}) near {}, eye {}", triangles[0],
                                       triangles[1], one.first, one.second, two.first, two.second,
                                       hex(glm::dvec3(end, 0)), hex(eye));
      }
    }
  }
  fmt::print("{} ends compared, {} of them cut, {} different\n", compared, cut, different);
  EXPECT_GT(cut, fitted(300U, 140U));
  EXPECT_EQ(different, 0U);
}

}  // namespace
}  // namespace parian::test
