// What the host does for a frame: the time that parian_frame and parian_gather (one subpixel position) take from call
// to return, and the share of the wall clock that the device spends outside kernels. A torus whose positions are in the
// caller's buffer, default settings, on one queue of the caller's.
#include <fmt/format.h>
#include <parian/parian.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "test_device.hpp"

namespace {

using Clock = std::chrono::steady_clock;
constexpr std::uint32_t around = 256, across = 128, width = 512, height = 512;
constexpr int rounds = 6, frames = 4;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

std::string spread(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return fmt::format("{:.3f} ({:.3f} to {:.3f})", values[values.size() / 2], values.front(), values.back());
}

double sum(const parian_seconds& s) {
  return s.plan + s.compile + s.light_map + s.layers + s.pyramids + s.gather + s.bias + s.read;
}

struct Triangles {
  std::vector<float> positions;
  std::vector<std::uint32_t> indices;
};

Triangles torus() {
  Triangles t;
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t j = 0; j < across; ++j) {
      const double u = 6.283185307179586 * i / around, v = 6.283185307179586 * j / across, ring = 36 + 14 * std::cos(v);
      for (const double x : {ring * std::cos(u), 14 * std::sin(v), ring * std::sin(u)})
        t.positions.push_back(static_cast<float>(x));
      const auto at = [](std::uint32_t k, std::uint32_t l) { return k % around * across + l % across; };
      for (const std::uint32_t c : {at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)})
        t.indices.push_back(c);
    }
  return t;
}

void measure(bool moving) {
  const cl::Device device = parian::test_device();
  const cl::Context context(device);
  const cl::CommandQueue queue(context, device, CL_QUEUE_PROFILING_ENABLE);
  auto [positions, indices] = torus();
  const cl::Buffer vertices(context, positions.begin(), positions.end(), true),
      triangles(context, indices.begin(), indices.end(), true),
      pixels(context, CL_MEM_READ_WRITE, std::size_t{16} * width * height);

  parian::v0::Renderer renderer(context(), device());
  renderer.set(parian::make<parian_settings>());
  auto mesh = parian::make<parian_mesh>();
  mesh.n_positions = static_cast<std::uint32_t>(positions.size() / 3);
  mesh.n_triangles = static_cast<std::uint32_t>(indices.size() / 3);
  mesh.position_buffer = vertices();
  mesh.index_buffer = triangles();
  mesh.radius = 50.1;
  renderer.set(mesh);
  parian_material marble{sizeof marble, {2.19, 2.62, 3.0}, {0.0021, 0.0041, 0.0071}, {}, 1.5, "marble"};
  renderer.set(marble);
  renderer.set(parian_light{sizeof(parian_light), {0.5, 0.6, -0.6}, {3.14, 3.14, 3.14}});
  renderer.set(parian_camera{sizeof(parian_camera), {0, 80, 180}, {}, {0, 1, 0}, 35}, width, height);
  auto image = parian::make<parian_image>();
  image.buffer = pixels();
  image.positions = 1;
  renderer.plan(queue());

  std::vector<double> frame_ms, gather_ms, idle;
  for (int round = 0; round < rounds; ++round) {  // the first compiles what a plan doesn't run
    const double busy_before = sum(renderer.statistics().kernel_seconds);
    cl::UserEvent start(context);
    cl_event wait = start();
    parian::Event done;
    for (int i = 0; i < frames; ++i) {
      if (moving) renderer.positions_changed();
      const Clock::time_point begin = Clock::now();
      const parian::Event frame =
          i == 0 ? renderer.frame(queue(), std::span<const cl_event>(&wait, 1)) : renderer.frame(queue());
      const double framed = seconds_since(begin);
      done = renderer.gather(0, image, queue());
      if (round == 0) continue;
      frame_ms.push_back(1e3 * framed);
      gather_ms.push_back(1e3 * (seconds_since(begin) - framed));
    }
    const Clock::time_point begin = Clock::now();
    start.setStatus(CL_COMPLETE);
    done.wait();
    const double wall = seconds_since(begin);
    if (round > 0) idle.push_back(100 * (1 - (sum(renderer.statistics().kernel_seconds) - busy_before) / wall));
  }
  std::vector<double> both;
  for (std::size_t i = 0; i < frame_ms.size(); ++i) both.push_back(frame_ms[i] + gather_ms[i]);
  fmt::print("{}: medians with least and most of {} frames\n", moving ? "positions moved each frame" : "nothing moved",
             both.size());
  fmt::print("  host, ms a frame: frame {}, gather {}, both {}\n", spread(frame_ms), spread(gather_ms), spread(both));
  fmt::print("  outside kernels, % of the wall clock: {}\n", spread(idle));
}

}  // namespace

int main() {
  fmt::print("{}\n", parian::test_device().getInfo<CL_DEVICE_NAME>());
  measure(false);
  measure(true);
  return 0;
}
