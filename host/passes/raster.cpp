// The rasteriser's launches: records of a view's triangles, nearest depths, ids; and where a film's samples lie.
#include "passes/raster.hpp"

#include <algorithm>

#include "core/same_bits.hpp"
#include "kernels/raster.h"
#include "kernels/sampling.h"
#include "passes/passes.hpp"

namespace parian {

static constexpr std::size_t large_items = 1024;  // work-items that draw large triangles

static std::size_t samples(const kernels::Window& w) { return pixels(w) << w.log_positions; }

std::size_t in_lanes(const Passes& p, std::size_t samples, std::uint32_t log_positions) {
  const std::size_t of_item = std::max(std::size_t{p.plan.lanes}, std::size_t{1} << log_positions);
  return (samples + of_item - 1) / of_item;
}
std::size_t in_lanes(const Passes& p, const kernels::Window& w) { return in_lanes(p, samples(w), w.log_positions); }

cl_uint launches(const Passes& p, const kernels::Window& w) { return p.plan.lanes == 1 ? 1U << w.log_positions : 1U; }

kernels::Window whole(const kernels::View& v, glm::ivec2 sample) {
  kernels::Window w{};
  w.width = v.width;
  w.height = v.height;
  w.sample_x = sample.x;
  w.sample_y = sample.y;
  return w;
}

glm::ivec2 subpixel_position(std::uint32_t i, std::uint32_t start) {
  const std::uint32_t k = i / 2;
  const std::uint32_t u = k * R2_STEP_U + kernels::hash(start), v = k * R2_STEP_V + kernels::hash(start ^ 0x68bc21ebU);
  const glm::ivec2 position(std::max(u >> 24, 1U), std::max(v >> 24, 1U));
  return i % 2 == 0 ? position : 256 - position;
}

std::uint32_t set_positions(kernels::Window& w, std::uint32_t first, std::uint32_t left) {
  w.log_positions = 0;
  while (2U << w.log_positions <= std::min(left, POSITIONS_SIDE_BY_SIDE)) ++w.log_positions;
  const std::uint32_t count = 1U << w.log_positions;
  std::fill(std::begin(w.subpixels), std::end(w.subpixels), 0);
  for (std::uint32_t i = 0; i < count; ++i) {
    const glm::uvec2 s(subpixel_position(first + i, 0));
    w.subpixels[i / 2] |= (s.x | s.y << 8) << 16 * (i % 2);
  }
  const glm::ivec2 s = subpixel_position(first, 0);
  w.sample_x = s.x;
  w.sample_y = s.y;
  return count;
}

void setup_view(Passes& p, const kernels::View& view, Stage stage) {
  Geometry& g = p.geometry;
  if (g.set_up && same_bits(*g.set_up, view)) return;  // the records are this view's
  g.set_up = view;
  p.compute.launch("raster_setup", g.n_triangles, stage, view, g.positions, g.triangles, g.n_triangles, g.records);
}

void draw(Passes& p, const kernels::Window& window, const cl::Buffer& depth, const cl::Buffer* ids, Stage stage) {
  const Geometry& g = p.geometry;
  const Film& f = p.film;
  const cl::Buffer& open = window.restricted ? f.open : depth;
  if (window.restricted) {
    const bool first = !f.drawn || f.window.log_positions != window.log_positions;
    p.compute.launch("raster_clear", pixels(window), stage, window, open, first ? 1U : 0U, depth, *ids);
  } else {
    p.compute.fill(depth, NO_DEPTH, samples(window));
    if (ids) p.compute.fill(*ids, NO_TRIANGLE, samples(window));
  }
  p.compute.fill(g.n_large, 0, 1);
  p.compute.launch("raster_depth", g.n_records, stage, window, open, g.records, g.n_records, g.n_large, g.large, depth);
  p.compute.launch("raster_depth_large", large_items, stage, window, open, g.records, g.n_large, g.large, depth);
  if (!ids) return;
  p.compute.launch("raster_ids", g.n_records, stage, window, open, g.records, g.n_records, depth, *ids);
  p.compute.launch("raster_ids_large", large_items, stage, window, open, g.records, g.n_large, g.large, depth, *ids);
}

}  // namespace parian
