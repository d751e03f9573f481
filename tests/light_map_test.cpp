// Pass 1 against rays and triangles in double, the height pyramid exactly, and the search for the nearest lit place.
#include <gtest/gtest.h>

#include <algorithm>

#include "kernels/sampling.h"
#include "passes/raster.hpp"
#include "test_scene.hpp"

namespace parian::test {
namespace {

using kernels::float4;

const DirectionalLight light_a{{0.5, 0.6, -0.6}, {3, 2, 1}}, light_b{{-0.2, 0.1, 1.0}, {1, 1, 1}};

std::vector<float4> read_map(Bench& b) {
  const LightMaps& m = b.passes.light_maps;
  return b.compute.read<float4>(m.map, std::size_t{2} * m.size * m.size * m.lights.size());
}

/// Compares both halves of all lights; the ids are drawn again into buffers of the test.
void check_maps(Bench& b, const std::string& what) {
  LightMaps& m = b.passes.light_maps;
  const std::vector<float4> map = read_map(b);
  const std::size_t texels = std::size_t{m.size} * m.size;
  Worst height, slope, normal;
  std::size_t lit = 0, edge = 0, bent = 0;
  for (const kernels::Light& light : m.lights)
    for (int half = 0; half < 2; ++half) {
      const int sample[2] = {int(light.sample_x[half] * 256), int(light.sample_y[half] * 256)};
      setup_view(b.passes, light.view, Stage::light_map);
      draw(b.passes, window_of(m.size, m.size, sample[0], sample[1]), m.depth, &m.ids, Stage::light_map);
      const std::vector<cl_uint> ids = b.compute.read<cl_uint>(m.ids, texels);
      const ExactView view(light.view);
      for (std::size_t i = 0; i < texels; ++i) {
        const MapTexel a(map[light.map + half * texels + i]);
        const std::string where = fmt::format("{} half {} texel ({}, {})", what, half, i % m.size, i / m.size);
        ASSERT_EQ(a.lit, ids[i] != 0xffffffffU) << where;
        if (!a.lit) continue;
        const std::size_t row = i / m.size;
        const double px = double(i % m.size) + light.sample_x[half], py = double(row) + light.sample_y[half];
        const Hit h = hit_triangle(b, ids[i], view, px, py);
        ++lit;
        if (!(h.cosine > 1e-3)) continue;  // seen edge-on: which side faces the light is up to rounding
        // Plane through the hit: dz = -(n_x dx + n_y dy) / n_z, the cosine at least 0.1.
        const glm::dvec3 g = view.frame(h.n_g);
        const double cosine = std::max(g.z, 0.1);
        slope.add(largest({std::fabs(a.slope.x + g.x / cosine), std::fabs(a.slope.y + g.y / cosine)}) * cosine *
                      cosine / 1.2e-6,
                  where);
        // Corners snap to 1/256 texel, so that a sample may lie that far outside of its triangle, and is moved inside.
        const double steep = std::sqrt(1 - g.z * g.z) / g.z, snap = 2.0 / 256 / light.view.scale;
        const double z = view.frame(h.x - view.origin).z;
        const bool inner = h.inside() > 1e-3;
        edge += !inner;
        height.add(std::fabs(a.height - z) / (1e-6 * (1 + steep) + (inner ? 0 : snap * (1 + steep))), where);
        // Only x and y are kept, to half a step of 1/32767; turned towards the light until their cosine is 0.01.
        const glm::dvec3 n_s = view.frame(h.n_s);
        const glm::dvec2 across(n_s.x, n_s.y),
            kept = n_s.z < 0.01 ? glm::normalize(across) * std::sqrt(0.9999) : across;
        bent += inner && n_s.z < 0.01;
        if (inner)
          normal.add(
              largest({std::fabs(a.n.x - kept.x), std::fabs(a.n.y - kept.y)}) / (0.5 / 32767 + 1e-5 * (1 + steep)),
              where);
      }
    }
  fmt::print(
      "{}: {} lit texels ({} at edges, {} with bent normals); of tolerance: height {:.2f} ({}), slopes {:.2f} ({}), "
      "normals {:.2f} ({})\n",
      what, lit, edge, bent, height.value, height.where, slope.value, slope.where, normal.value, normal.where);
  EXPECT_GT(lit, texels / 8);
  EXPECT_LE(height.value, 1) << height.where;  // float32 positions of size 1, along the slope
  EXPECT_LE(slope.value, 1) << slope.where;    // twenty roundings of a normal, over the cosine's square
  EXPECT_LE(normal.value, 1) << normal.where;  // packing; barycentric coordinates within float32 of the triangle's size
}

class LightMap : public testing::TestWithParam<std::uint32_t> {};

TEST_P(LightMap, HoldsTheSurface) {
  const std::uint32_t size = GetParam();
  Bench b(scene_of(torus(40, 20), medium(), {light_a, light_b}));
  make_light_maps(b.passes, b.points, size);
  for (const std::uint32_t epoch : {0U, 3U}) {
    draw_light_maps(b.passes, epoch, epoch > 0);
    check_maps(b, fmt::format("torus {} epoch {}", size, epoch));
  }
}

TEST_P(LightMap, HeightPyramidBoundsTheTexelsPieces) {
  const std::uint32_t size = GetParam();
  Bench b(scene_of(torus(40, 20), medium(), {light_a, light_b}));
  make_light_maps(b.passes, b.points, size);
  draw_light_maps(b.passes, 0, true);
  const std::vector<float4> map = read_map(b);
  const LightMaps& m = b.passes.light_maps;
  std::vector<std::size_t> first{0};
  std::vector<std::size_t> side;
  for (std::size_t s = size;; s = (s + 1) / 2) {
    side.push_back(s);
    first.push_back(first.back() + s * s);
    if (s == 1) break;
  }
  ASSERT_EQ(m.levels, side.size());
  const std::vector<cl_float2> extent = b.compute.read<cl_float2>(m.extent, first.back() * m.lights.size());
  for (const kernels::Light& light : m.lights)
    for (std::size_t k = 0; k < std::size_t{size} * size; ++k) {
      const float4 texel = map[light.map + k];
      if (texel.x <= -8) continue;
      const double rise = (std::fabs(double{texel.y}) + std::fabs(double{texel.z})) / 2 / light.view.scale;
      const cl_float2 found = extent[light.extent + k];
      const double tolerance = 4 * 0x1p-24 * (std::fabs(double{texel.x}) + rise);  // a quotient of 2.5 ulp and two sums
      ASSERT_NEAR(found.s[0], texel.x - rise, tolerance) << "texel " << k;
      ASSERT_NEAR(found.s[1], texel.x + rise, tolerance) << "texel " << k;
    }
  for (const kernels::Light& light : m.lights)
    for (std::size_t level = 0; level < side.size(); ++level)
      for (std::size_t node = 0; node < side[level] * side[level]; ++node) {
        // The block of texels below the node, without going through the levels between.
        const std::size_t block = std::size_t{1} << level, x0 = node % side[level] * block,
                          y0 = node / side[level] * block;
        float low = INFINITY, high = -INFINITY;
        for (std::size_t y = y0; y < std::min<std::size_t>(y0 + block, size); ++y)
          for (std::size_t x = x0; x < std::min<std::size_t>(x0 + block, size); ++x) {
            if (map[light.map + y * size + x].x <= -8) continue;
            const cl_float2 texel = extent[light.extent + y * size + x];
            low = std::min(low, texel.s[0]), high = std::max(high, texel.s[1]);
          }
        const cl_float2 found = extent[light.extent + first[level] + node];
        if (low > high)
          ASSERT_GT(found.s[0], found.s[1]) << "level " << level << " node " << node;
        else
          ASSERT_TRUE(found.s[0] == low && found.s[1] == high) << "level " << level << " node " << node;
      }
}

/// The vector from t to the nearest point of the rectangle's part of the plane z = slope . (x, y) with |x|, |y| <= 0.5:
/// the foot of the perpendicular where it lies inside, else the best of the four sides.
glm::dvec3 to_rectangle(const glm::dvec3& t, const glm::dvec2& slope) {
  const auto away = [&](double x, double y) { return glm::dvec3(x, y, slope.x * x + slope.y * y) - t; };
  const glm::dvec3 n = glm::normalize(glm::dvec3(-slope, 1.0)), foot = t - glm::dot(n, t) * n;
  if (std::fabs(foot.x) <= 0.5 && std::fabs(foot.y) <= 0.5) return foot - t;
  glm::dvec3 best(INFINITY);
  const auto offer = [&](const glm::dvec3& a) {
    if (!(glm::length(a) >= glm::length(best))) best = a;
  };
  for (const double side : {-0.5, 0.5}) {
    const glm::dvec3 along_y(0, 1, slope.y), along_x(1, 0, slope.x);
    const double y = -glm::dot(away(side, 0), along_y) / glm::dot(along_y, along_y);
    const double x = -glm::dot(away(0, side), along_x) / glm::dot(along_x, along_x);
    offer(away(side, std::clamp(y, -0.5, 0.5)));
    offer(away(std::clamp(x, -0.5, 0.5), side));
  }
  return best;
}

/// What centres are off by, in units of the tolerance.
struct CentreErrors {
  Worst place, h, G;
  std::size_t along = 0;  // points with a smaller h_min
};

/// One point's centre in the map of one light, against all of the map's texels.
class CentreCheck {
 public:
  CentreCheck(const Bench& b, std::uint32_t size, const kernels::Light& light, const float4* texels, glm::dvec3 x,
              glm::dvec3 n)
      : b_(b), size_(size), light_(light), texels_(texels), view_(light.view), n_(view_.frame(n)) {
    const glm::dvec3 f = view_.film(x);
    t_ = {f.x, f.y, view_.frame(x - view_.origin).z * light.view.scale};
    for (std::size_t k = 0; k < std::size_t{size} * size; ++k)
      if (const MapTexel texel(texels[k]); texel.lit)
        nearest_.emplace_back(glm::length(to_rectangle(t_ - sample(texel, k), texel.slope)), k);
    std::sort(nearest_.begin(), nearest_.end());
  }

  /// Any texel whose piece is nearly as near may be the centre's: the square of the distance within three tenths.
  void compare(const float4& c, const std::string& where, CentreErrors& errors) const {
    // Coordinates up to `size` texels in float32, through some roundings.
    const double rounding = 8 * 0x1p-23 * double(size_), least = nearest_[0].first;
    double off = INFINITY, off_h = INFINITY;
    bool is_along = false;
    for (const auto& [d, k] : nearest_) {
      if (d > least / std::sqrt(0.7) + rounding) break;
      const auto [off_k, off_h_k, along] = off_by(c, d, k, rounding);
      if (std::max(off_k, off_h_k) >= std::max(off, off_h)) continue;
      off = off_k, off_h = off_h_k;
      is_along = along;
    }
    errors.along += is_along;
    errors.place.add(off, where);
    errors.h.add(off_h, where);
    errors.G.add(off_G(c), where);
  }

 private:
  [[nodiscard]] glm::dvec3 sample(const MapTexel& texel, std::size_t k) const {
    const std::size_t row = k / size_;
    return {double(k % size_) + light_.sample_x[0], double(row) + light_.sample_y[0], texel.height * light_.view.scale};
  }

  struct Off {
    double place, h;
    bool along;
  };
  /// A centre from texel k, whose piece is at distance d.
  [[nodiscard]] Off off_by(const float4& c, double d, std::size_t k, double rounding) const {
    const double scale = light_.view.scale, h_min = b_.plan.density.parameters.h_min;
    const glm::dvec2 chosen(c.x * scale + light_.view.centre_x, c.y * scale + light_.view.centre_y);
    const MapTexel texel(texels_[k]);
    const glm::dvec2 on_piece = chosen - glm::dvec2(sample(texel, k));
    const double outside = std::max(std::fabs(on_piece.x), std::fabs(on_piece.y)) - 0.5;
    const double farther =
        glm::length(glm::dvec3(chosen, sample(texel, k).z + glm::dot(texel.slope, on_piece)) - t_) - d;
    const kernels::real3 w12 = kernels::refract_into({0, 0, 1}, {texel.n.x, texel.n.y, texel.n.z}, b_.plan.boundary);
    const double mu_0 = -glm::dot(glm::dvec3(w12.x, w12.y, w12.z), n_);
    const double smaller = mu_0 > 0 ? std::clamp(mu_0 / 0.75, double{LEAST_H_MIN}, 1.0) : 1.0;
    const double h = std::hypot(smaller * h_min, d / scale);
    // Around mu_0 = 0, either.
    const double h_0 = std::fabs(mu_0) < 1e-6 ? std::hypot(h_min, d / scale) : h;
    const double tolerance = 1e-6 * h + rounding / scale;
    // A piece leans up to ten times as far as it is wide.
    return {std::max(outside, farther) / (8 * rounding), std::min(std::fabs(c.z - h), std::fabs(c.z - h_0)) / tolerance,
            smaller < 1};
  }

  /// log G of the h that was read back, on the line between the entries that hold it.
  [[nodiscard]] double off_G(const float4& c) const {
    const auto& rho = b_.plan.density.rho;
    const kernels::Density& density = b_.plan.density.parameters;
    std::size_t e = 0;
    while (e + 2 < density.entries && rho[e + 1][0] > c.z) ++e;
    const double a = rho[e][0], z = rho[e + 1][0], at = std::clamp((a - c.z) / (a - z), 0.0, 1.0);
    const double log_G = density.log_G_min + (double(e) + at) / density.inverse_step;
    return std::fabs(c.w - log_G) / (4 * 0x1p-24 * std::max(std::fabs(log_G), std::fabs(double{density.log_G_min})));
  }

  const Bench& b_;
  std::size_t size_;
  const kernels::Light& light_;
  const float4* texels_;
  ExactView view_;
  glm::dvec3 n_, t_{};  // the point, in texels
  std::vector<std::pair<double, std::size_t>> nearest_;
};

TEST_P(LightMap, SamplesAreCentredOnTheNearestLitSurface) {
  const std::uint32_t size = GetParam();
  Bench b(scene_of(torus(40, 20), medium(), {light_a, light_b}));
  make_light_maps(b.passes, b.points, size);
  draw_light_maps(b.passes, 3, true);  // shifted, and drawn anew
  std::vector<kernels::View> views;
  for (const glm::dvec3& d : even_directions(4)) views.push_back(orthographic_view(b.points, d, 20));
  make_layers(b.passes, views, false);
  std::vector<cl_uint> needed;
  const std::vector<cl_uint> slots = b.compute.read<cl_uint>(b.passes.layers.slots, 4 * 20 * 20);
  for (cl_uint t = 0; t < slots.size(); ++t)
    if (slots[t] == 0) needed.push_back(t);
  set_needed(b.passes, needed);
  const std::vector<float4> map = read_map(b),
                            points = b.compute.read<float4>(b.passes.layers.points, 2 * needed.size());
  const LightMaps& m = b.passes.light_maps;
  const std::vector<float4> centres = b.compute.read<float4>(b.passes.layers.centres, needed.size() * m.lights.size());
  CentreErrors errors;
  for (std::size_t i = 0; i < needed.size(); ++i)
    for (std::size_t l = 0; l < m.lights.size(); ++l) {
      const glm::dvec3 x = exact(points[2 * i]);
      CentreCheck(b, size, m.lights[l], &map[m.lights[l].map], x, exact(points[2 * i + 1]))
          .compare(centres[l * needed.size() + i], fmt::format("size {} light {} point {}", size, l, hex(x)), errors);
    }
  const auto& [place, h_error, G_error, along] = errors;
  fmt::print(
      "size {}: {} points, {} with light along them; of tolerance: place {:.2f} ({}), h {:.2f} ({}), log G "
      "{:.2f} ({})\n",
      size, needed.size(), along, place.value, place.where, h_error.value, h_error.where, G_error.value, G_error.where);
  EXPECT_GT(needed.size(), 300U);
  EXPECT_GT(along, 20U);
  EXPECT_LE(place.value, 1) << place.where;
  EXPECT_LE(h_error.value, 1) << h_error.where;
  EXPECT_LE(G_error.value, 1) << G_error.where;
}

INSTANTIATE_TEST_SUITE_P(Sizes, LightMap, testing::Values(128U, 100U, 33U));

}  // namespace
}  // namespace parian::test
