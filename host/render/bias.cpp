// How far the layers are from pass 2 at the pixels' own points: the error that more samples don't remove.
#include <algorithm>
#include <cmath>
#include <random>

#include "core/relative_error.hpp"
#include "kernels/raster.h"
#include "passes/direct.hpp"
#include "passes/edges.hpp"
#include "passes/raster.hpp"
#include "render/renderer_state.hpp"

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
  PixelDifferences d;
  d.pixels = choose_pixels(image, settings.seed);
  if (d.pixels.empty()) return -1.0;
  d.a.resize(d.pixels.size());
  d.b.resize(d.pixels.size());
  std::vector<std::size_t> inside;  // of d.pixels, in the window that is gathered
  std::vector<cl_uint> in_window;   // where these are in it
  Gathering picture(camera, {0}, positions);
  picture.waits = true;
  picture.chosen = [&](const kernels::Window& w) {
    inside.clear();
    in_window.clear();
    for (std::size_t i = 0; i < d.pixels.size(); ++i) {
      const std::size_t x = d.pixels[i] % scene.film.x - w.x, y = d.pixels[i] / scene.film.x - w.y;
      if (x >= w.width || y >= w.height) continue;
      inside.push_back(i);
      in_window.push_back(static_cast<cl_uint>(y * w.width + x));
    }
    return in_window;
  };
  picture.take = [&](const kernels::Window& w) {
    const Timer timer(statistics.seconds.bias);
    const glm::vec3 weight(colour / static_cast<double>(positions));
    const std::vector<kernels::float4> sums = compute.read<kernels::float4>(passes.film.sums, pixels(w) * 2);
    for (std::size_t i = 0; i < inside.size(); ++i) {
      const kernels::float4 a = sums[2 * in_window[i]], b = sums[2 * in_window[i] + 1];
      d.a[inside[i]] = glm::vec3(a.x, a.y, a.z) * weight;
      d.b[inside[i]] = glm::vec3(b.x, b.y, b.z) * weight;
    }
  };
  run({.picture = &picture});
  statistics.bias_evaluations +=
      static_cast<double>(d.pixels.size()) * positions * rounds_of(positions) * samples_per_frame() * plan.channels();
  return estimated_bias_relmse(image, d, expected(camera));
}

}  // namespace parian
