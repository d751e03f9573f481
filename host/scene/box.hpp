// The smallest box, along the axes, around points.
#pragma once
#include <glm/glm.hpp>
#include <limits>

namespace parian {

/// Empty at first: low above high.
template <class Vector = glm::dvec3>
struct Box {
  Vector low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};

  void add(const Vector& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  [[nodiscard]] Vector size() const { return high - low; }
};

/// Of the longest side.
[[nodiscard]] inline double longest(const glm::dvec3& size) { return glm::max(size.x, glm::max(size.y, size.z)); }

}  // namespace parian
