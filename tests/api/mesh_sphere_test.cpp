// Spheres of meshes in buffers that are given wrong, or not at all: the picture is right, or a warning says why not.
#include <algorithm>

#include "frames.hpp"

namespace parian::test {
namespace {

std::vector<std::string> warnings(parian_renderer* r) {
  auto statistics = sized<parian_statistics>();
  EXPECT_EQ(parian_get_statistics(r, &statistics), PARIAN_SUCCESS);
  std::vector<std::string> all;
  for (std::size_t i = 0; i < statistics.n_warnings; ++i) {
    const char* text = nullptr;
    EXPECT_EQ(parian_get_warning(r, i, &text), PARIAN_SUCCESS);
    all.emplace_back(text);
  }
  return all;
}

bool says(const std::vector<std::string>& texts, const std::string& words) {
  return std::any_of(texts.begin(), texts.end(), [&](const auto& t) { return t.find(words) != std::string::npos; });
}

/// A mesh in buffers with a sphere of its own; enough samples for two estimates to be compared.
struct InSphere {
  InSphere(const SmallScene& scene, double radius, double x = 0.0)
      : vertices(opencl().buffer(scene.positions)), triangles(opencl().buffer(scene.indices)) {
    parian_mesh mesh = SmallScene::mesh(scene, vertices, triangles);
    mesh.radius = radius;
    mesh.centre[0] = x;
    EXPECT_EQ(parian_set_mesh(r.get(), &mesh), PARIAN_SUCCESS) << parian_message();
    EXPECT_EQ(scene.describe(r.get()), PARIAN_SUCCESS) << parian_message();
    EXPECT_EQ(parian_plan(r.get(), nullptr), PARIAN_SUCCESS) << parian_message();
  }
  Rgba after(int n) {
    frames(r.get(), n);
    return gathered(r.get(), nullptr, 8);
  }
  cl::Buffer vertices, triangles;
  Handle r = create();
};

SmallScene fine_scene() {
  SmallScene scene;
  scene.settings.layers = 16;
  scene.settings.layer_size = 64;
  scene.settings.light_map_size = 128;
  return scene;
}

TEST(MeshSphere, TooSmallOnesGrow) {
  const SmallScene scene = fine_scene();
  InSphere right(scene, 42.1);
  EXPECT_TRUE(warnings(right.r.get()).empty());
  const Rgba wanted = right.after(64);
  for (const double radius : {30.0, 21.0, 10.0, 1.0, 1e-6}) {
    InSphere wrong(scene, radius, 5.0);
    const Rgba found = wrong.after(64);
    // Other layers, other views of the light: two estimates of the same picture, as of a mesh on the host.
    EXPECT_LE(relmse(found, wanted), 2e-3) << "radius " << radius;
    double light = 0.0, right_light = 0.0;
    for (std::size_t i = 0; i < found.size(); ++i)
      if (i % 4 < 3) light += found[i], right_light += wanted[i];
    EXPECT_NEAR(light / right_light, 1.0, 0.01) << "radius " << radius;
    EXPECT_TRUE(says(warnings(wrong.r.get()), "doesn't hold it")) << "radius " << radius;
  }
}

TEST(MeshSphere, NoneIsMeasured) {
  const SmallScene scene = fine_scene();
  InSphere measured(scene, 0.0, 1e9);  // whatever its centre
  EXPECT_TRUE(warnings(measured.r.get()).empty());
  EXPECT_LE(relmse(measured.after(64), InSphere(scene, 42.1).after(64)), 2e-3);
  // Nothing to measure.
  SmallScene nothing = scene;
  std::fill(nothing.positions.begin(), nothing.positions.end(), 3.0F);
  const cl::Buffer vertices = opencl().buffer(nothing.positions), triangles = opencl().buffer(nothing.indices);
  parian_mesh mesh = SmallScene::mesh(nothing, vertices, triangles);
  mesh.radius = 0.0;
  const Handle r = create();
  CALL(parian_set_mesh(r.get(), &mesh));
  CALL(nothing.describe(r.get()));
  EXPECT_EQ(parian_plan(r.get(), nullptr), PARIAN_INVALID_SCENE);
  EXPECT_NE(std::string(parian_message()).find("radius"), std::string::npos) << parian_message();
  std::size_t bytes = 0;
  CALL(parian_scratch_size(r.get(), &bytes));
  EXPECT_GT(bytes, 1000000U);
}

TEST(MeshSphere, TooLargeOnesAreWarnedAbout) {
  const SmallScene scene;
  EXPECT_FALSE(says(warnings(InSphere(scene, 120.0).r.get()), "large beside it"));
  EXPECT_TRUE(says(warnings(InSphere(scene, 200.0).r.get()), "large beside it"));
  // In which nothing of the mesh is left: that isn't a picture without an error.
  for (const double radius : {1e4, 1e6, 1e12}) {
    InSphere wrong(scene, radius);
    frames(wrong.r.get(), 2);
    double estimated = 0.0, read = 0.0;
    CALL(parian_estimate(wrong.r.get(), nullptr, &estimated));
    Rgba rgba(Pixels::count * 4);
    CALL(parian_read(wrong.r.get(), nullptr, 0, rgba.data(), &read));
    double light = 0.0;
    for (std::size_t i = 0; i < rgba.size(); ++i) light += i % 4 < 3 ? rgba[i] : 0.0F;
    if (light > 0.0) continue;
    EXPECT_LT(estimated, 0.0) << "radius " << radius;
    EXPECT_LT(read, 0.0) << "radius " << radius;
    const auto said = warnings(wrong.r.get());
    EXPECT_TRUE(says(said, "the picture is black") || says(said, "no subpixel position")) << "radius " << radius;
  }
}

TEST(MeshSphere, LeavingItIsToldByTheNextCallThatWaits) {
  const SmallScene scene;
  SmallScene grown = scene;
  for (float& x : grown.positions) x *= 1.5F;
  InSphere mesh(scene, 42.1);
  const auto move = [&](const SmallScene& to) {
    opencl().queue.enqueueWriteBuffer(mesh.vertices, CL_TRUE, 0, to.positions.size() * 4, to.positions.data());
    CALL(parian_positions_changed(mesh.r.get()));
    frames(mesh.r.get(), 1);
  };
  move(scene);
  double estimated = 0.0;
  CALL(parian_estimate(mesh.r.get(), nullptr, &estimated));
  EXPECT_TRUE(warnings(mesh.r.get()).empty());
  move(grown);
  move(scene);  // it is back: what was shown meanwhile was wrong all the same
  CALL(parian_estimate(mesh.r.get(), nullptr, &estimated));
  const auto said = warnings(mesh.r.get());
  ASSERT_EQ(said.size(), 1U);
  const std::size_t at = said[0].find("give a radius of ");
  ASSERT_NE(at, std::string::npos) << said[0];
  EXPECT_NEAR(std::stod(said[0].substr(at + 17)), 63.0, 0.2) << said[0];
}

}  // namespace
}  // namespace parian::test
