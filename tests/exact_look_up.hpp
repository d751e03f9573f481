// The gather's look-up of a point in layers, in double, from what a device stored.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "test_scene.hpp"

namespace parian::test {

inline constexpr cl_uint no_slot = 0xffffffffU;

/// All levels of the layers as the device has them.
struct Stored {
  explicit Stored(Bench& b) : k(b.passes.layers) {
    geometry = b.compute.read<kernels::float4>(k.geometry, k.level_first.back());
    slots = b.compute.read<cl_uint>(k.slots, k.level_first.back());
    values = b.compute.read<kernels::float4>(k.values, 2 * (k.n_points + k.level_first.back() - k.level_first[1]));
  }
  const Layers& k;
  std::vector<kernels::float4> geometry, values;
  std::vector<cl_uint> slots;
};

/// Weighted sums of both halves' values around a point.
struct Lookup {
  glm::dvec3 a{}, b{};
  double weight = 0, weight_error = 0;  // what float32 may change of the weights
  bool doubtful = false;                // a test is so close that rounding decides
  bool oblique = false;
};

/// Bilinear weight x (cos^2 - least) over the four texels around a point in each layer whose cos^2 is above `least`,
/// where texel and point lie within half a texel of each other's planes and their normals within 60 degrees.
inline Lookup look_up(const Stored& s, cl_uint level, glm::dvec3 x, glm::dvec3 n, double least) {
  Lookup sum;
  for (cl_uint layer = 0; layer < s.k.count(); ++layer) {
    const ExactView view(s.k.views[layer]);
    const glm::dvec3 n_p = view.frame(n), f = view.film(x);
    const double facing = n_p.z > 0 ? n_p.z * n_p.z - least : 0;
    if (facing <= 0) continue;
    const int side = 1 << level, extent = (int(s.k.views[0].width) + side - 1) / side;
    const double size = side / double{view.view.scale}, u = f.x / side - 0.5, v = f.y / side - 0.5;
    for (int c = 0; c < 4; ++c) {
      const int column = int(std::floor(u)) + c % 2, row = int(std::floor(v)) + c / 2;
      if (column < 0 || row < 0 || column >= extent || row >= extent) continue;
      const std::size_t t = s.k.level_first[level] + (layer * extent + row) * std::size_t(extent) + column;
      const cl_uint slot = s.slots[t];
      if (slot == no_slot) continue;
      const glm::dvec3 n_t = exact(s.geometry[t]);
      const glm::dvec3 away((column - u) * size, (row - v) * size, s.geometry[t].w - f.z);
      const double off = std::max(std::fabs(glm::dot(away, n_p)), std::fabs(glm::dot(away, n_t))) / (0.5 * size);
      const double alike = glm::dot(n_t, n_p), bilinear = (1 - std::fabs(column - u)) * (1 - std::fabs(row - v));
      sum.doubtful |= std::fabs(off - 1) < 3e-4 || std::fabs(alike - 0.5) < 1e-5;
      if (off > 1 || alike <= 0.5) continue;
      // Film coordinates of up to 64 texels round to 4e-6 texels, four times; the normal has 1e-6.
      sum.weight += bilinear * facing, sum.weight_error += 1.6e-5 * facing + 2e-6 * bilinear;
      sum.a += bilinear * facing * exact(s.values[2 * slot]);
      sum.b += bilinear * facing * exact(s.values[2 * slot + 1]);
    }
  }
  sum.doubtful |= std::fabs(sum.weight - 1e-3) <= 2 * sum.weight_error;
  return sum;
}

/// Layers with cos^2 below 0.2 are asked, down to 0.0025, only where the others' weights come to less than 1e-3.
inline Lookup look_up(const Stored& s, cl_uint level, glm::dvec3 x, glm::dvec3 n) {
  Lookup sum = look_up(s, level, x, n, 0.2);
  if (sum.doubtful || sum.weight >= 1e-3) return sum;
  sum = look_up(s, level, x, n, 0.0025);
  sum.oblique = true;
  return sum;
}

}  // namespace parian::test
