// One axis after the other: the step between floats, and whether coordinates are on it.
#include "scene/rounding.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace parian {
namespace {

constexpr double coarse = 1e-4;      // step, of the box's longest side
constexpr double odd_share = 0.125;  // of coordinates that sit on odd steps: of rounded ones it is a half

/// Whether all coordinates along an axis are floats, and of those as large as `reach` many use the last bit.
bool is_rounded(const std::vector<glm::dvec3>& points, int axis, double reach, double step) {
  std::size_t far = 0, odd = 0;
  for (const glm::dvec3& p : points) {
    const double x = p[axis];
    if (x != static_cast<double>(static_cast<float>(x))) return false;
    if (std::abs(x) < 0.5 * reach) continue;
    ++far;
    if (std::fmod(std::abs(x) / step, 2.0) == 1.0) ++odd;
  }
  return static_cast<double>(odd) > odd_share * static_cast<double>(far);
}

}  // namespace

std::string rounding_warning(const std::vector<glm::dvec3>& points, const glm::dvec3& low, const glm::dvec3& high) {
  const glm::dvec3 size = high - low;
  const double longest = std::max({size.x, size.y, size.z});
  int worst = -1;
  double worst_reach = 0.0, worst_step = coarse * longest;
  for (int axis = 0; axis < 3; ++axis) {
    const double reach = std::max(std::abs(low[axis]), std::abs(high[axis]));
    if (!(reach > 0.0) || !std::isfinite(reach)) continue;
    constexpr int bits = 24;  // of a float's significand
    const double step = std::exp2(std::floor(std::log2(reach)) + 1 - bits);
    if (step <= worst_step || !is_rounded(points, axis, reach, step)) continue;
    worst = axis;
    worst_reach = reach;
    worst_step = step;
  }
  if (worst < 0) return {};
  return fmt::format(
      "coordinates are floats far from the origin: {} of up to {:.4g} comes in steps of {:.3g}, in a box "
      "of {:.4g}, and the surface is a staircase; move the mesh to the origin before it is made single "
      "precision",
      "xyz"[worst], worst_reach, worst_step, longest);
}

}  // namespace parian
