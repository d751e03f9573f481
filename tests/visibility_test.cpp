// Where layers stand: what an orthographic view and the opposite one see at once, and how much the chosen views cover.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "kernels/raster.h"
#include "passes/raster.hpp"
#include "passes/visibility.hpp"
#include "test_render.hpp"
#include "test_scene.hpp"

namespace parian::test {
namespace {

/// The nearest depths of a view as they are drawn, and the farthest of the triangles that were set up for that.
void check_sight(Bench& b, const kernels::View& view, const std::string& what) {
  const std::size_t n = std::size_t{view.width} * view.height;
  Geometry& g = b.passes.geometry;
  g.set_up.reset();  // corners take the records' place
  const kernels::Window window = window_of(view.width, view.height);
  const cl::Buffer nearest = b.compute.buffer<cl_uint>(n), farthest = b.compute.buffer<cl_uint>(n);
  b.compute.fill(nearest, 0xffffffffU, n);
  b.compute.fill(farthest, 0, n);
  b.compute.launch("visibility_corners", g.n_positions, Stage::plan, view, g.positions, g.n_positions, g.records);
  b.compute.launch("visibility_sight", g.n_triangles, Stage::plan, window, g.records, g.triangles, g.n_triangles,
                   nearest, farthest);
  const std::vector<cl_uint> found = b.compute.read<cl_uint>(nearest, n);
  setup_view(b.passes, view, Stage::plan);
  draw(b.passes, window, nearest, nullptr, Stage::plan);
  EXPECT_EQ(found, b.compute.read<cl_uint>(nearest, n)) << what;

  std::vector<cl_uint> expected(n, 0);
  for (const kernels::RasterTriangle& t : b.compute.read<kernels::RasterTriangle>(g.records, g.n_records)) {
    if (t.triangle == 0xffffffffU) continue;
    const kernels::PixelBox box = kernels::pixel_box(t, window);
    for (int y = box.y0; y < box.y1; ++y)
      for (int x = box.x0; x < box.x1; ++x)
        if (cl_uint& e = expected[std::size_t(y) * view.width + std::size_t(x)];
            kernels::covers(t, 256 * x + 128, 256 * y + 128))
          e = std::max(e, ~std::bit_cast<cl_uint>(kernels::nearness(t, 256 * x + 128, 256 * y + 128)));
  }
  EXPECT_EQ(b.compute.read<cl_uint>(farthest, n), expected) << what;
  EXPECT_LT(std::count(expected.begin(), expected.end(), 0U), 9 * n / 10) << what;
}

TEST(Visibility, NearestAndFarthest) {
  Random random(1);
  const std::pair<const char*, Mesh> meshes[] = {
      {"fine torus", torus(96, 48)}, {"jittered cube", box(3, 1)}, {"coarse sphere", icosphere(0)}};
  for (const auto& [name, mesh] : meshes) {
    Bench b(scene_of(mesh));
    for (int i = 0; i < 4; ++i) {
      const glm::dvec3 towards = random.direction();
      check_sight(b, orthographic_view(b.points, towards, fitted(128U, 48U)),
                  fmt::format("{} from {}", name, hex(towards)));
    }
  }
}

TEST(Visibility, LayersCoverTheModels) {
  for (const char* name : {"figure", "torus", "concave", "slab"}) {
    Bench b(scene_of(model(name)));
    const auto cover = [&](const std::vector<kernels::View>& views, const SurfaceSight& sight) {
      make_layers(b.passes, views, false);
      const double covered = layer_coverage(b.passes, sight);
      release_layers(b.passes);
      return covered;
    };
    SurfaceSight sight;
    const std::vector<kernels::View> views = place_layers(b.passes, b.points, b.scene.mesh.triangles, 16, 256, sight);
    ASSERT_LE(views.size(), 16U);  // fewer where more would see nothing better
    ASSERT_FALSE(views.empty());
    std::vector<kernels::View> even;
    for (const glm::dvec3& d : even_directions(16)) even.push_back(orthographic_view(b.points, d, 256));
    const double chosen = cover(views, sight), spread = cover(even, sight);
    fmt::print("{}: chosen layers cover {:.4f}, evenly spread ones {:.4f}\n", name, chosen, spread);
    EXPECT_GE(chosen, 0.99) << name;
    // The choice rests on 16384 points and films of another size: what a few points tell is noise.
    EXPECT_GE(chosen, spread - 1e-3) << name;
  }
}

TEST(Visibility, SurfacePointsDontDependOnTheOrderOfTriangles) {
  Mesh mesh = box(4, 2);
  const SurfacePoints before = surface_points(mesh.positions, mesh.triangles, 1000);
  std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), std::mt19937(3));
  const SurfacePoints after = surface_points(mesh.positions, mesh.triangles, 1000);
  EXPECT_EQ(before.x, after.x);
  EXPECT_EQ(before.n, after.n);
}

}  // namespace
}  // namespace parian::test
