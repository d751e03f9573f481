// A scene that takes milliseconds, as a program that embeds Parian hands it over: everything through parian.h.
#pragma once
#include <gtest/gtest.h>
#include <parian/parian.h>

#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "test_device.hpp"

namespace parian::test {

/// The device under test with two contexts of it; for the whole run, as programs keep theirs.
struct Opencl {
  cl::Device device = test_device();
  cl::Context context{device}, other{device};
  cl::CommandQueue queue{context, device}, other_queue{other, device};
  cl::CommandQueue unordered{context, device, CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE};

  [[nodiscard]] cl::Buffer buffer(std::size_t bytes) const { return {context, CL_MEM_READ_WRITE, bytes}; }
  template <class T>
  [[nodiscard]] cl::Buffer buffer(const std::vector<T>& data) const {
    return {context, CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, data.size() * sizeof(T), const_cast<T*>(data.data())};
  }
};
inline const Opencl& opencl() {
  static const Opencl all;
  return all;
}

using Handle = std::unique_ptr<parian_renderer, void (*)(parian_renderer*)>;

template <class T>
T sized() {
  T t{};
  t.struct_size = sizeof t;
  return t;
}

inline parian_create_info in_context(const cl::Context& context = opencl().context) {
  auto info = sized<parian_create_info>();
  info.context = context();
  info.device = opencl().device();
  return info;
}

inline Handle create(const parian_create_info& info = in_context()) {
  parian_renderer* renderer = nullptr;
  EXPECT_EQ(parian_create(&info, &renderer), PARIAN_SUCCESS) << parian_message();
  return {renderer, &parian_release};
}

/// A call that should succeed, with the message if it doesn't.
#define CALL(...) ASSERT_EQ(__VA_ARGS__, PARIAN_SUCCESS) << parian_message()

/// A torus in millimetres, whose light comes from behind and the side.
struct SmallScene {
  static constexpr std::uint32_t around = 16, across = 10, width = 16, height = 12;
  std::vector<float> positions;
  std::vector<std::uint32_t> indices;
  parian_settings settings = sized<parian_settings>();
  parian_material material = sized<parian_material>();
  std::vector<parian_light> lights{light({0.5, 0.6, -0.6}, 3.0)};
  parian_camera camera = sized<parian_camera>();

  SmallScene() {
    for (std::uint32_t i = 0; i < around * across; ++i) {
      const std::uint32_t ring_number = i / across;
      const double u = 6.283185307179586 * ring_number / around, v = 6.283185307179586 * (i % across) / across;
      const double ring = 30.0 + 12.0 * std::cos(v);
      for (const double x : {ring * std::cos(u), 12.0 * std::sin(v), ring * std::sin(u)})
        positions.push_back(static_cast<float>(x));
    }
    const auto at = [](std::uint32_t i, std::uint32_t j) { return i % around * across + j % across; };
    for (std::uint32_t i = 0; i < around; ++i)
      for (std::uint32_t j = 0; j < across; ++j)
        for (const std::uint32_t c :
             {at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)})
          indices.push_back(c);
    EXPECT_EQ(parian_default_settings(&settings), PARIAN_SUCCESS);
    settings.layers = 4;
    settings.layer_size = 24;
    settings.light_map_size = 32;
    material.sigma_s[0] = 2.19, material.sigma_s[1] = 2.62, material.sigma_s[2] = 3.0;
    material.sigma_a[0] = 0.0021, material.sigma_a[1] = 0.0041, material.sigma_a[2] = 0.0071;
    material.ior = 1.5;
    camera.eye[1] = 70.0, camera.eye[2] = 140.0;
    camera.up[1] = 1.0;
    camera.fov = 35.0;
  }
  static parian_light light(std::array<double, 3> towards, double irradiance) {
    auto l = sized<parian_light>();
    for (int c = 0; c < 3; ++c) {
      l.towards[c] = towards[c];
      l.irradiance[c] = irradiance;
    }
    return l;
  }
  [[nodiscard]] parian_mesh mesh() const {
    auto m = sized<parian_mesh>();
    m.n_positions = static_cast<std::uint32_t>(positions.size() / 3);
    m.n_triangles = static_cast<std::uint32_t>(indices.size() / 3);
    m.positions = positions.data();
    m.indices = indices.data();
    return m;
  }
  /// The same in buffers.
  static parian_mesh mesh(const SmallScene& scene, const cl::Buffer& vertices, const cl::Buffer& triangles) {
    parian_mesh m = scene.mesh();
    m.positions = nullptr;
    m.indices = nullptr;
    m.position_buffer = vertices();
    m.index_buffer = triangles();
    m.radius = 42.1;
    return m;
  }
  /// Everything but a mesh; the first failure.
  parian_status describe(parian_renderer* r) const {
    for (const parian_status s :
         {parian_set_settings(r, &settings), parian_set_material(r, &material),
          parian_set_lights(r, lights.size(), lights.data()), parian_set_cameras(r, 1, &camera, width, height)})
      if (s != PARIAN_SUCCESS) return s;
    return PARIAN_SUCCESS;
  }
  /// With the mesh in host memory.
  parian_status give(parian_renderer* r) const {
    const parian_mesh m = mesh();
    const parian_status s = parian_set_mesh(r, &m);
    return s != PARIAN_SUCCESS ? s : describe(r);
  }
};

/// A buffer of the small scene's film, and what a gather puts there.
struct Pixels {
  static constexpr std::size_t count = std::size_t{SmallScene::width} * SmallScene::height, bytes = count * 16;
  cl::Buffer buffer = opencl().buffer(bytes);

  [[nodiscard]] parian_image image(std::uint32_t positions = 2) const {
    auto i = sized<parian_image>();
    i.buffer = buffer();
    i.positions = positions;
    return i;
  }
  /// Once `done`, which is released, is complete.
  [[nodiscard]] std::vector<float> read(cl_event done) const {
    std::vector<float> rgba(count * 4);
    const std::vector<cl::Event> wait{cl::Event(done)};
    opencl().queue.enqueueReadBuffer(buffer, CL_TRUE, 0, bytes, rgba.data(), &wait);
    return rgba;
  }
};

using Rgba = std::vector<float>;

/// What a gather shows; empty, with a failed expectation, if it fails.
inline Rgba gathered(parian_renderer* r, cl_command_queue queue = nullptr, std::uint32_t positions = 2) {
  const Pixels pixels;
  const parian_image image = pixels.image(positions);
  cl_event done = nullptr;
  const parian_status status = parian_gather(r, queue, 0, &image, 0, nullptr, &done);
  EXPECT_EQ(status, PARIAN_SUCCESS) << parian_message();
  return status == PARIAN_SUCCESS ? pixels.read(done) : Rgba{};
}

/// So many frames, then the image that is read.
inline Rgba read_after(parian_renderer* r, int frames, cl_command_queue queue = nullptr) {
  for (int i = 0; i < frames; ++i)
    EXPECT_EQ(parian_frame(r, queue, 0, nullptr, nullptr), PARIAN_SUCCESS) << parian_message();
  Rgba rgba(Pixels::count * 4);
  EXPECT_EQ(parian_read(r, queue, 0, rgba.data(), nullptr), PARIAN_SUCCESS) << parian_message();
  return rgba;
}

/// The image that a small scene should give, made once.
inline const Rgba& right_image(int frames = 2) {
  static std::array<Rgba, 4> images;
  Rgba& image = images.at(frames);
  if (!image.empty()) return image;
  const Handle r = create();
  const SmallScene scene;
  EXPECT_EQ(scene.give(r.get()), PARIAN_SUCCESS) << parian_message();
  EXPECT_EQ(parian_plan(r.get(), nullptr), PARIAN_SUCCESS) << parian_message();
  return image = read_after(r.get(), frames);
}

/// Light and coverage are there, finite and not negative.
inline void expect_picture(const Rgba& rgba) {
  double light = 0.0, covered = 0.0;
  std::size_t bad = 0;
  for (std::size_t i = 0; i < rgba.size(); ++i) {
    bad += !(std::isfinite(rgba[i]) && rgba[i] >= 0.0F);
    (i % 4 < 3 ? light : covered) += rgba[i];
  }
  EXPECT_EQ(bad, 0U) << "values that aren't finite or are negative";
  EXPECT_GT(covered, 10.0);
  EXPECT_GT(light, 0.0);
}

}  // namespace parian::test
