// A mesh that deforms: a kernel of the caller's own writes the positions, frame after frame, and Parian reads them
// where they are. Kernel, frame and image are chained by events, on an out-of-order queue if the device has them. The
// host sees nothing until the last image, which has to be what a renderer makes that has seen none of the shapes
// before.
#define CL_HPP_TARGET_OPENCL_VERSION 120
#define CL_HPP_MINIMUM_OPENCL_VERSION 120
#define CL_HPP_ENABLE_EXCEPTIONS
#include <CL/opencl.hpp>
#include <array>
#include <cstdlib>
#include <iostream>
#include <parian/parian.hpp>
#include <string>
#include <vector>

#include "torus.h"

namespace {

constexpr std::uint32_t width = 96, height = 64;

constexpr const char* source = R"(
kernel void torus(global float* xyz, float thickness) {
  const uint i = get_global_id(0);
  const float turn = 6.2831853f / SIDE, u = turn * (i / SIDE), v = turn * (i % SIDE);
  const float ring = 50.0f - thickness + thickness * cos(v);
  vstore3((float3)(ring * cos(u), thickness * sin(v), ring * sin(u)), i, xyz);
})";

void set_scene(parian::Renderer& renderer, const cl::Buffer& positions, const cl::Buffer& indices) {
  auto settings = parian::make<parian_settings>();
  settings.layers = 8;
  settings.layer_size = 64;
  settings.light_map_size = 128;
  renderer.set(settings);
  auto mesh = parian::make<parian_mesh>();
  mesh.n_positions = TORUS_POSITIONS;
  mesh.n_triangles = TORUS_TRIANGLES;
  mesh.position_buffer = positions();
  mesh.index_buffer = indices();
  mesh.radius = 51;  // all shapes fit into this sphere
  renderer.set(mesh);
  renderer.set(parian::material({2.19, 2.62, 3.00}, {0.0021, 0.0041, 0.0071}, 1.5));
  renderer.set(parian::light({0.5, 0.6, -0.6}, {3.14, 3.14, 3.14}));
  renderer.set(parian::camera({0, 120, 250}, {0, 0, 0}, 30), width, height);
}

/// The exit code of the last image beside that of its shape alone.
int judge(const std::vector<float>& last, const std::vector<float>& alone) {
  double covered = 0;
  for (std::size_t i = 3; i < last.size(); i += 4) covered += last[i];
  std::cout << "6 shapes, the last covers " << covered << " pixels\n";
  if (covered > 500 && last == alone) return 0;
  std::cerr << "deforming: the last image isn't that of its shape alone\n";
  return 1;
}

}  // namespace

int main() try {
  parian::Renderer renderer(std::getenv("PARIAN_DEVICE"));
  const cl::Context context(renderer.context(), true);
  const cl::Device device(renderer.device_id(), true);
  const cl::CommandQueue queue(context, device,
                               device.getInfo<CL_DEVICE_QUEUE_PROPERTIES>() & CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE);
  cl::Program program(context, source);
  program.build(device, ("-DSIDE=" + std::to_string(TORUS_SIDE)).c_str());
  cl::Kernel kernel(program, "torus");
  std::vector<std::uint32_t> corners(3 * TORUS_TRIANGLES);
  torus_indices(corners.data());
  const cl::Buffer indices(context, CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, corners.size() * 4, corners.data());
  const cl::Buffer positions(context, CL_MEM_READ_WRITE, TORUS_POSITIONS * 3 * sizeof(float));
  const cl::Buffer pixels(context, CL_MEM_READ_WRITE, width * height * 4 * sizeof(float));

  // The caller's kernel, after `done`: what has read the shape before may not see this one.
  const auto deform = [&](float thickness, const parian::Event& done) {
    std::vector<cl::Event> after;
    if (done.get()) after.emplace_back(done.get(), true);
    kernel.setArg(0, positions);
    kernel.setArg(1, thickness);
    cl::Event moved;
    queue.enqueueNDRangeKernel(kernel, {}, TORUS_POSITIONS, {}, &after, &moved);
    return moved;
  };
  auto image = parian::make<parian_image>();
  image.buffer = pixels();
  image.positions = 8;
  const auto read = [&](const parian::Event& done) {
    std::vector<float> rgba(width * height * 4);
    const std::vector<cl::Event> after{cl::Event(done.get(), true)};
    queue.enqueueReadBuffer(pixels, CL_TRUE, 0, rgba.size() * sizeof(float), rgba.data(), &after);
    return rgba;
  };

  set_scene(renderer, positions, indices);
  deform(6, {}).wait();  // a plan looks at positions, too, and has no wait list
  renderer.plan(queue());
  parian::Event done;
  for (int i = 0; i < 6; ++i) {
    const cl::Event moved = deform(6.0F + 2.0F * static_cast<float>(i), done);
    renderer.positions_changed();
    const parian::Event frame = renderer.frame(queue(), std::array{moved()});
    done = renderer.gather(0, image, queue(), std::array{frame.get()});
  }
  const std::vector<float> last = read(done);

  parian::Renderer other(context(), device());
  set_scene(other, positions, indices);
  other.plan(queue());
  other.frame(queue());
  const std::vector<float> alone = read(other.gather(0, image, queue()));

  return judge(last, alone);
} catch (const std::exception& failure) {
  std::cerr << "deforming: " << failure.what() << '\n';
  return 1;
}
