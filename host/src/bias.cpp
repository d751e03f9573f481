// How far the layers are from pass 2 at the pixels' own points: the error that more samples don't remove.
#include <algorithm>
#include <cmath>
#include <random>

#include "kernels/raster.h"
#include "relative_error.hpp"
#include "renderer_state.hpp"

namespace parian {
namespace {

constexpr std::size_t chosen_pixels = 1024;
constexpr std::uint32_t positions = POSITIONS_SIDE_BY_SIDE;  // subpixel positions that both sides are compared at

/// Some covered pixels at random, each once, in ascending order.
std::vector<std::size_t> choose_pixels(const Halves& image, std::uint32_t seed) {
  std::vector<std::size_t> covered;
  for (std::size_t i = 0; i < image.alpha.size(); ++i)
    if (image.alpha[i] >= fully_covered) covered.push_back(i);
  std::mt19937 random(seed);
  const std::size_t n = std::min(chosen_pixels, covered.size());
  for (std::size_t i = 0; i < n; ++i) std::swap(covered[i], covered[i + random() % (covered.size() - i)]);
  covered.resize(n);
  std::sort(covered.begin(), covered.end());
  return covered;
}

}  // namespace

double Renderer::State::bias_relmse(std::size_t camera, const Halves& image) {
  const Timer timer(statistics.seconds.bias);
  const kernels::View& view = cameras[camera];
  PixelDifferences d;
  d.pixels = choose_pixels(image, settings.seed);
  if (d.pixels.empty()) return -1.0;
  d.a.resize(d.pixels.size());
  d.b.resize(d.pixels.size());
  const std::uint32_t rounds = (frame + positions - 1) / positions;  // as many samples as a texel has had
  for (kernels::Window w : tiles(scene.film, plan.window)) {
    std::vector<std::size_t> inside;  // of d.pixels
    std::vector<cl_uint> in_window;
    for (std::size_t i = 0; i < d.pixels.size(); ++i) {
      const std::size_t x = d.pixels[i] % scene.film.x - w.x, y = d.pixels[i] / scene.film.x - w.y;
      if (x >= w.width || y >= w.height) continue;
      inside.push_back(i);
      in_window.push_back(static_cast<cl_uint>(y * w.width + x));
    }
    if (inside.empty()) continue;
    const std::size_t pixels = std::size_t{w.width} * w.height;
    compute.fill(passes.film.sums, 0, pixels * 8);
    std::vector<cl_uint> open(pixels, 0);
    for (const cl_uint i : in_window) open[i] = 1;
    compute.write(passes.film.open, open);
    restrict_film(passes, view, w);
    set_positions(w, 0, positions);
    draw_film(passes, view, w, false, Stage::bias);
    gather(passes, view, w, layers_of(camera), {0}, 1.0F / static_cast<float>(frame), 0, rounds, Stage::bias);
    subtract_direct(passes, view, w, in_window, 0, rounds, Stage::bias);
    free_film(passes, w);
    const std::vector<kernels::float4> sums = compute.read<kernels::float4>(passes.film.sums, pixels * 2);
    for (std::size_t i = 0; i < inside.size(); ++i) {
      const kernels::float4 a = sums[2 * in_window[i]], b = sums[2 * in_window[i] + 1];
      d.a[inside[i]] = glm::vec3(a.x, a.y, a.z) * glm::vec3(colour / static_cast<double>(positions));
      d.b[inside[i]] = glm::vec3(b.x, b.y, b.z) * glm::vec3(colour / static_cast<double>(positions));
    }
  }
  compute.finish();
  statistics.bias_evaluations +=
      static_cast<double>(d.pixels.size()) * positions * rounds * samples_per_frame() * plan.channels();
  return estimated_bias_relmse(image, d, expected(camera));
}

}  // namespace parian
