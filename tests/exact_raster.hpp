// The rasteriser by brute force in exact integers, from the set-up of triangles that a device stored.
#pragma once
#include <algorithm>
#include <bit>
#include <cstdint>
#include <utility>
#include <vector>

#include "test_scene.hpp"

namespace parian::test {

using kernels::RasterTriangle;
using kernels::Window;

/// A sample on an edge belongs to the triangle that holds the points just right of it, and of those just below it: the
/// sign of an edge function is that of its value, then of its change to the right, then of its change downwards.
inline bool inside(const RasterTriangle& t, std::int64_t px, std::int64_t py) {
  const std::int64_t x[3] = {t.x0, t.x1, t.x2}, y[3] = {t.y0, t.y1, t.y2};
  const std::int64_t area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
  const std::int64_t turn = area < 0 ? -1 : 1;
  for (int c = 0; c < 3; ++c) {
    const std::int64_t dx = turn * (x[(c + 1) % 3] - x[c]), dy = turn * (y[(c + 1) % 3] - y[c]);
    const std::int64_t edge = dx * (py - y[c]) - dy * (px - x[c]);  // below 2^51: corners lie within 2^25
    const bool in = edge != 0 ? edge > 0 : dy != 0 ? dy < 0 : dx > 0;
    if (!in) return false;
  }
  return area != 0;
}

/// The depth plane in float32, as documented: value at corner 0 plus slopes, kept between the corners' values.
inline std::uint32_t depth_key(const RasterTriangle& t, int px, int py) {
  const float at = t.q0 + t.q_x * static_cast<float>(px - t.x0) + t.q_y * static_cast<float>(py - t.y0);
  return ~std::bit_cast<std::uint32_t>(std::min(std::max(at, t.q_min), t.q_max));
}

/// A window's depths and ids; 0xffffffff where nothing is.
struct Visible {
  std::vector<cl_uint> depth, ids;
};

/// What the records show in a window.
inline Visible reference(const std::vector<RasterTriangle>& records, const Window& w) {
  Visible v{std::vector<cl_uint>(std::size_t{w.width} * w.height, 0xffffffffU), {}};
  v.ids = v.depth;
  for (const RasterTriangle& t : records) {
    if (t.triangle == 0xffffffffU) continue;
    // The samples that can be inside at all, generously.
    const auto range = [](int a, int b, int c, std::uint32_t first, std::uint32_t count) {
      const int low = std::min({a, b, c}) / 256 - 2, high = std::max({a, b, c}) / 256 + 2;
      return std::pair(std::max(low, int(first)), std::min(high, int(first + count) - 1));
    };
    const auto [left, right] = range(t.x0, t.x1, t.x2, w.x, w.width);
    const auto [top, bottom] = range(t.y0, t.y1, t.y2, w.y, w.height);
    for (int y = top; y <= bottom; ++y)
      for (int x = left; x <= right; ++x) {
        const int px = 256 * x + w.sample_x, py = 256 * y + w.sample_y;
        if (!inside(t, px, py)) continue;
        const std::size_t i = std::size_t(y - int(w.y)) * w.width + std::size_t(x - int(w.x));
        const std::uint32_t key = depth_key(t, px, py);
        if (key < v.depth[i] || (key == v.depth[i] && t.triangle < v.ids[i])) v.depth[i] = key, v.ids[i] = t.triangle;
      }
  }
  return v;
}

}  // namespace parian::test
