// A mesh that deforms: a kernel of the caller's own writes the positions, frame after frame, and Parian reads them
// where they are. Kernel, frame and image are chained by events on an out-of-order queue; the host sees nothing until
// the last image, which has to be what a renderer makes that has seen none of the shapes before.
#define CL_TARGET_OPENCL_VERSION 120
#include <parian/parian.hpp>

#include <array>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <stdexcept>
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
  xyz[3 * i] = ring * cos(u);
  xyz[3 * i + 1] = thickness * sin(v);
  xyz[3 * i + 2] = ring * sin(u);
})";

void require(cl_int code, const char* what) {
  if (code != CL_SUCCESS) throw std::runtime_error(what + (": OpenCL code " + std::to_string(code)));
}

/// What OpenCL makes, with the code that says whether it did.
template <class F>
auto made(const char* what, F&& make) {
  cl_int code = CL_SUCCESS;
  const auto handle = make(&code);
  require(code, what);
  return handle;
}

void set_scene(parian::Renderer& renderer, cl_mem positions, cl_mem indices) {
  auto settings = parian::make<parian_settings>();
  settings.layers = 8;
  settings.layer_size = 64;
  settings.light_map_size = 128;
  renderer.set(settings);
  auto mesh = parian::make<parian_mesh>();
  mesh.n_positions = TORUS_POSITIONS;
  mesh.n_triangles = TORUS_TRIANGLES;
  mesh.position_buffer = positions;
  mesh.index_buffer = indices;
  mesh.radius = 51;  // all shapes fit into this sphere
  renderer.set(mesh);
  renderer.set(parian_material{sizeof(parian_material), {2.19, 2.62, 3.00}, {0.0021, 0.0041, 0.0071}, {}, 1.5});
  renderer.set(parian_light{sizeof(parian_light), {0.5, 0.6, -0.6}, {3.14, 3.14, 3.14}});
  renderer.set(parian_camera{sizeof(parian_camera), {0, 120, 250}, {0, 0, 0}, {0, 1, 0}, 30}, width, height);
}

}  // namespace

int main() try {
  parian::Renderer renderer(std::getenv("PARIAN_DEVICE"));
  cl_context context = nullptr;
  cl_device_id device = nullptr;
  parian::require(parian_get_opencl(renderer.get(), &context, &device));

  const auto queue = made("queue", [&](cl_int* code) {
    return clCreateCommandQueue(context, device, CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE, code);
  });
  const auto program = made("program", [&](cl_int* code) {
    return clCreateProgramWithSource(context, 1, &const_cast<const char*&>(source), nullptr, code);
  });
  require(clBuildProgram(program, 1, &device, ("-DSIDE=" + std::to_string(TORUS_SIDE)).c_str(), nullptr, nullptr),
          "build");
  const auto kernel = made("kernel", [&](cl_int* code) { return clCreateKernel(program, "torus", code); });
  std::vector<std::uint32_t> corners(3 * TORUS_TRIANGLES);
  torus_indices(corners.data());
  const auto indices = made("indices", [&](cl_int* code) {
    return clCreateBuffer(context, CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, corners.size() * 4, corners.data(), code);
  });
  const auto buffer = [&](std::size_t bytes) {
    return made("buffer",
                [&](cl_int* code) { return clCreateBuffer(context, CL_MEM_READ_WRITE, bytes, nullptr, code); });
  };
  const cl_mem positions = buffer(TORUS_POSITIONS * 3 * sizeof(float));
  const cl_mem pixels = buffer(width * height * 4 * sizeof(float));

  /// Enqueues the caller's kernel.
  const auto deform = [&](float thickness, const parian::Event& after) {
    const cl_event wait = after.get();
    cl_event done = nullptr;
    const std::size_t items = TORUS_POSITIONS;
    require(clSetKernelArg(kernel, 0, sizeof positions, &positions), "argument");
    require(clSetKernelArg(kernel, 1, sizeof thickness, &thickness), "argument");
    require(
        clEnqueueNDRangeKernel(queue, kernel, 1, nullptr, &items, nullptr, wait ? 1 : 0, wait ? &wait : nullptr, &done),
        "launch");
    return parian::Event(done);
  };
  auto image = parian::make<parian_image>();
  image.buffer = pixels;
  image.positions = 8;
  const auto read = [&](const parian::Event& after) {
    std::vector<float> rgba(width * height * 4);
    const cl_event wait = after.get();
    require(clEnqueueReadBuffer(queue, pixels, CL_TRUE, 0, rgba.size() * 4, rgba.data(), 1, &wait, nullptr), "read");
    return rgba;
  };

  set_scene(renderer, positions, indices);
  deform(6, {}).wait();  // a plan looks at positions, too
  renderer.plan(queue);
  parian::Event done;
  for (int i = 0; i < 6; ++i) {
    const parian::Event moved = deform(6.0F + 2.0F * static_cast<float>(i), done);
    renderer.positions_changed();
    const parian::Event frame = renderer.frame(queue, std::array{moved.get()});
    done = renderer.gather(0, image, queue, std::array{frame.get()});
  }
  const std::vector<float> last = read(done);

  parian::Renderer other(context, device);
  set_scene(other, positions, indices);
  other.plan(queue);
  const parian::Event frame = other.frame(queue);
  const std::vector<float> alone = read(other.gather(0, image, queue, std::array{frame.get()}));

  double covered = 0;
  for (std::size_t i = 3; i < last.size(); i += 4) covered += last[i];
  std::cout << "6 shapes, the last covers " << covered << " pixels\n";
  clReleaseMemObject(pixels);
  clReleaseMemObject(positions);
  clReleaseMemObject(indices);
  clReleaseKernel(kernel);
  clReleaseProgram(program);
  clReleaseCommandQueue(queue);
  if (covered > 500 && last == alone) return 0;
  std::cerr << "deforming: the last image isn't that of its shape alone\n";
  return 1;
} catch (const std::exception& failure) {
  std::cerr << "deforming: " << failure.what() << '\n';
  return 1;
}
