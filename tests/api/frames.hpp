// What tests of frames and of changes between them share.
#pragma once
#include <array>

#include "relmse.hpp"
#include "small_scene.hpp"

namespace parian::test {

inline Handle planned(const SmallScene& scene, cl_command_queue queue = nullptr) {
  Handle r = create();
  EXPECT_EQ(scene.give(r.get()), PARIAN_SUCCESS) << parian_message();
  EXPECT_EQ(parian_plan(r.get(), queue), PARIAN_SUCCESS) << parian_message();
  return r;
}

inline void frames(parian_renderer* r, int n, cl_command_queue queue = nullptr) {
  for (int i = 0; i < n; ++i)
    ASSERT_EQ(parian_frame(r, queue, 0, nullptr, nullptr), PARIAN_SUCCESS) << parian_message();
}

/// What a renderer that is planned for the scene gathers after so many frames.
inline Rgba fresh(const SmallScene& scene, int n) {
  const Handle r = planned(scene);
  frames(r.get(), n);
  return gathered(r.get());
}

inline std::uint32_t summed(parian_renderer* r) {
  auto statistics = sized<parian_statistics>();
  EXPECT_EQ(parian_get_statistics(r, &statistics), PARIAN_SUCCESS);
  return statistics.frames;
}

inline Rgba scaled(Rgba image, std::array<float, 3> factor) {
  for (std::size_t i = 0; i < image.size(); ++i)
    if (i % 4 < 3) image[i] *= factor[i % 4];
  return image;
}

/// A renderer of a mesh in buffers.
struct OnDevice {
  explicit OnDevice(const SmallScene& s, cl_command_queue queue = nullptr)
      : vertices(opencl().buffer(s.positions)), triangles(opencl().buffer(s.indices)) {
    const parian_mesh mesh = SmallScene::mesh(s, vertices, triangles);
    EXPECT_EQ(parian_set_mesh(r.get(), &mesh), PARIAN_SUCCESS) << parian_message();
    EXPECT_EQ(s.describe(r.get()), PARIAN_SUCCESS) << parian_message();
    EXPECT_EQ(parian_plan(r.get(), queue), PARIAN_SUCCESS) << parian_message();
  }
  Rgba after(int n) {
    frames(r.get(), n);
    return gathered(r.get());
  }
  cl::Buffer vertices, triangles;
  Handle r = create();
};

}  // namespace parian::test
