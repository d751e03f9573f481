// Two renderers of one context at work in two threads, each with a queue of its own: each makes the image that it makes
// alone, bit for bit.
#define CL_HPP_TARGET_OPENCL_VERSION 120
#define CL_HPP_MINIMUM_OPENCL_VERSION 120
#define CL_HPP_ENABLE_EXCEPTIONS
#include <CL/opencl.hpp>
#include <array>
#include <cstdlib>
#include <future>
#include <iostream>
#include <parian/parian.hpp>
#include <vector>

#include "torus.h"

namespace {

constexpr std::uint32_t width = 96, height = 64;

/// Three frames of a torus, enqueued on a queue of this call's own.
std::vector<float> render(cl_context context, cl_device_id device, float thickness, const parian_material& material) {
  std::vector<float> positions(3 * TORUS_POSITIONS);
  std::vector<std::uint32_t> indices(3 * TORUS_TRIANGLES);
  torus_positions(positions.data(), thickness);
  torus_indices(indices.data());

  parian::Renderer renderer(context, device);
  auto settings = parian::make<parian_settings>();
  settings.layers = 8;
  settings.layer_size = 64;
  settings.light_map_size = 128;
  renderer.set(settings);
  renderer.set_mesh(positions, indices);
  renderer.set(material);
  renderer.set(parian::light({0.5, 0.6, -0.6}, {3.14, 3.14, 3.14}));
  renderer.set(parian::camera({0, 120, 250}, {0, 0, 0}, 30), width, height);

  const cl::CommandQueue queue(cl::Context(context, true), cl::Device(device, true));
  renderer.plan(queue());
  for (int i = 0; i < 3; ++i) renderer.frame(queue());
  std::vector<float> rgba(4 * width * height);
  renderer.read(0, rgba, queue());
  return rgba;
}

}  // namespace

int main() try {
  const parian::Renderer first(std::getenv("PARIAN_DEVICE"));  // for its context and device
  const cl_context context = first.context();
  const cl_device_id device = first.device_id();

  const auto marble = parian::material({2.19, 2.62, 3.00}, {0.0021, 0.0041, 0.0071}, 1.5);
  const auto milk = parian::material({2.55, 3.21, 3.77}, {0.0011, 0.0024, 0.014}, 1.3);
  const auto thin = [&] { return render(context, device, 9.0F, milk); };
  const auto thick = [&] { return render(context, device, 14.0F, marble); };

  const std::array alone{thin(), thick()};
  auto one = std::async(std::launch::async, thin), two = std::async(std::launch::async, thick);
  const std::array together{one.get(), two.get()};

  if (alone == together && alone[0] != alone[1]) return 0;
  std::cerr << "two_threads: together the renderers made other images than alone\n";
  return 1;
} catch (const std::exception& failure) {
  std::cerr << "two_threads: " << failure.what() << '\n';
  return 1;
}
