// Meshes in the caller's buffers: they move, lack what is broken, and give the pictures of the same mesh on the host.
#include <algorithm>
#include <limits>

#include "frames.hpp"

namespace parian::test {
namespace {

TEST(MeshOnDevice, MovedPositionsStartAnew) {
  const SmallScene scene;
  SmallScene bent = scene;
  for (std::size_t i = 1; i < bent.positions.size(); i += 3)
    bent.positions[i] *= 0.7F + 0.3F * std::sin(0.1F * bent.positions[i - 1]);  // inside its sphere
  OnDevice mesh(scene);
  frames(mesh.r.get(), 20);
  opencl().queue.enqueueWriteBuffer(mesh.vertices, CL_TRUE, 0, bent.positions.size() * 4, bent.positions.data());
  const Rgba before = gathered(mesh.r.get());
  CALL(parian_positions_changed(mesh.r.get()));
  EXPECT_EQ(gathered(mesh.r.get()), before) << "until the next frame";
  EXPECT_EQ(mesh.after(2), OnDevice(bent).after(2));
  EXPECT_EQ(summed(mesh.r.get()), 2U);
  const Handle on_host = planned(scene);
  EXPECT_EQ(parian_positions_changed(on_host.get()), PARIAN_INVALID_ARGUMENT);
}

// Such a mesh may move whatever cameras do: fixed ones change nothing, and their own views can't be the layers.
TEST(MeshOnDevice, FixedCamerasMakeNoDifference) {
  SmallScene fixed, moving;
  fixed.settings.fixed_cameras = 1;
  OnDevice one(fixed), other(moving);
  EXPECT_EQ(one.after(1), other.after(1));
  CALL(parian_positions_changed(one.r.get()));
  CALL(parian_positions_changed(other.r.get()));
  EXPECT_EQ(one.after(2), other.after(2));
  fixed.settings.views = PARIAN_CAMERA;
  CALL(parian_set_settings(one.r.get(), &fixed.settings));
  EXPECT_EQ(parian_plan(one.r.get(), nullptr), PARIAN_INVALID_ARGUMENT);
  EXPECT_NE(std::string(parian_message()).find("views"), std::string::npos) << parian_message();
}

TEST(MeshOnDevice, AgreesWithTheMeshOnTheHost) {
  SmallScene scene;
  scene.settings.layers = 16;
  scene.settings.layer_size = 64;
  scene.settings.light_map_size = 128;
  const Handle host = planned(scene);
  const OnDevice device(scene);
  frames(host.get(), 64);
  frames(device.r.get(), 64);
  const double difference = relmse(gathered(device.r.get(), nullptr, 8), gathered(host.get(), nullptr, 8));
  RecordProperty("relmse", std::to_string(difference));
  EXPECT_LE(difference, 2e-3);  // other layers, other views of the light: two estimates of the same picture
}

TEST(MeshOnDevice, LeavesOutWhatIsBroken) {
  const SmallScene whole;
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  const float bad[] = {nan, infinity, -infinity, 3e38F, -1e20F, 1e6F, 100.0F};
  SmallScene broken = whole, removed = whole;
  removed.indices.clear();
  for (std::size_t k = 0; k < std::size(bad); ++k) broken.positions[3 * (20 * k + 3) + k % 3] = bad[k];
  broken.indices[50] = 0xffffffff;
  broken.indices[200] = 0x7fffffff;
  broken.indices[300] = static_cast<std::uint32_t>(whole.positions.size() / 3);
  for (std::size_t t = 0; t < whole.indices.size(); t += 3) {
    const auto* c = &broken.indices[t];
    const bool sound = std::all_of(c, c + 3, [&](std::uint32_t i) {
      return i < whole.positions.size() / 3 && broken.positions[3 * i] == whole.positions[3 * i] &&
             broken.positions[3 * i + 1] == whole.positions[3 * i + 1] &&
             broken.positions[3 * i + 2] == whole.positions[3 * i + 2];
    });
    if (sound) removed.indices.insert(removed.indices.end(), c, c + 3);
  }
  EXPECT_LT(removed.indices.size(), whole.indices.size() - 100);
  const Rgba image = OnDevice(broken).after(2);
  expect_picture(image);
  EXPECT_EQ(image, OnDevice(removed).after(2));
  // Nothing that can be drawn, now and then.
  SmallScene nothing = whole;
  std::fill(nothing.positions.begin(), nothing.positions.end(), nan);
  OnDevice mesh(nothing);
  for (const float v : mesh.after(2)) ASSERT_EQ(v, 0.0F);
  opencl().queue.enqueueWriteBuffer(mesh.vertices, CL_TRUE, 0, whole.positions.size() * 4, whole.positions.data());
  CALL(parian_positions_changed(mesh.r.get()));
  EXPECT_EQ(mesh.after(2), OnDevice(whole).after(2));
}

TEST(MeshOnDevice, OffsetsAndStrides) {
  SmallScene scene;
  const Rgba right = OnDevice(scene).after(1);
  std::vector<float> spread(6, -1.0F);
  for (std::size_t i = 0; i < scene.positions.size(); i += 3) {
    spread.insert(spread.end(), scene.positions.begin() + i, scene.positions.begin() + i + 3);
    spread.insert(spread.end(), 5, 1e9F);
  }
  spread.resize(spread.size() - 5);  // nothing after the last
  std::vector<std::uint32_t> indices(7, 99999);
  indices.insert(indices.end(), scene.indices.begin(), scene.indices.end());
  const cl::Buffer vertices = opencl().buffer(spread), triangles = opencl().buffer(indices);
  parian_mesh mesh = SmallScene::mesh(scene, vertices, triangles);
  mesh.position_offset = 24;
  mesh.position_stride = 32;
  mesh.index_offset = 28;
  const Handle r = create();
  CALL(parian_set_mesh(r.get(), &mesh));
  CALL(scene.describe(r.get()));
  CALL(parian_plan(r.get(), nullptr));
  frames(r.get(), 1);
  EXPECT_EQ(gathered(r.get()), right);
}

}  // namespace
}  // namespace parian::test
