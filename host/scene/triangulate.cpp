// Ear clipping in the polygon's mean plane; quads by their better diagonal.
#include "scene/triangulate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace parian {
namespace {

/// Twice the area vector (Newell), relative to the first corner so that far-away polygons lose nothing.
glm::dvec3 area_vector(std::span<const glm::dvec3> corners) {
  glm::dvec3 sum(0.0);
  for (std::size_t i = 2; i < corners.size(); ++i)
    sum += glm::cross(corners[i - 1] - corners[0], corners[i] - corners[0]);
  return sum;
}

void split_quad(std::span<const glm::dvec3> c, const glm::dvec3& normal, std::vector<glm::uvec3>& triangles) {
  const auto area = [&](int i, int j, int k) { return glm::dot(glm::cross(c[j] - c[i], c[k] - c[i]), normal); };
  const double even = std::min(area(0, 1, 2), area(0, 2, 3));
  const double odd = std::min(area(0, 1, 3), area(1, 2, 3));
  const double rounding = 1e-12 * glm::dot(normal, normal);
  const bool shorter = glm::distance(c[0], c[2]) <= glm::distance(c[1], c[3]);
  if (std::abs(even - odd) <= rounding ? shorter : even > odd) {
    triangles.emplace_back(0, 1, 2);
    triangles.emplace_back(0, 2, 3);
  } else {
    triangles.emplace_back(0, 1, 3);
    triangles.emplace_back(1, 2, 3);
  }
}

/// The polygon in its plane while ears are cut from it: a ring of the corners that are left.
class Ring {
 public:
  Ring(std::span<const glm::dvec3> corners, const glm::dvec3& normal) : size_(corners.size()) {
    const glm::dvec3 n = normal / glm::length(normal);
    const glm::dvec3 helper = std::abs(n.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 u = glm::normalize(glm::cross(helper, n));
    const glm::dvec3 v = glm::cross(n, u);
    double largest = 0.0;
    for (const glm::dvec3& corner : corners) {
      const glm::dvec3 d = corner - corners[0];
      points_.emplace_back(glm::dot(d, u), glm::dot(d, v));
      largest = std::max(largest, glm::dot(d, d));
    }
    // Rounding of an area of edges this long; what is smaller counts as a straight corner.
    straight_ = 16.0 * std::numeric_limits<double>::epsilon() * largest;
    for (std::uint32_t i = 0; i < size_; ++i) {
      before_.push_back(i == 0 ? static_cast<std::uint32_t>(size_) - 1 : i - 1);
      after_.push_back(i + 1 == size_ ? 0 : i + 1);
    }
    for (std::uint32_t i = 0; i < size_; ++i)
      if (area(i) <= straight_) reflex_.push_back(i);
  }

  void cut_all(std::vector<glm::uvec3>& triangles) {
    std::uint32_t at = 0;
    while (size_ > 3) {
      std::uint32_t tried = 0;
      while (tried < size_ && !is_ear(at)) {
        at = after_[at];
        ++tried;
      }
      if (tried == size_) at = widest(at);  // crosses itself: no ear is left
      at = cut(at, triangles);
    }
    triangles.emplace_back(before_[at], at, after_[at]);
  }

 private:
  static double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }
  double area(std::uint32_t i, std::uint32_t j, std::uint32_t k) const {
    return cross(points_[j] - points_[i], points_[k] - points_[i]);
  }
  double area(std::uint32_t i) const { return area(before_[i], i, after_[i]); }

  bool is_ear(std::uint32_t i) const {
    if (area(i) <= straight_) return false;
    const std::uint32_t a = before_[i];
    const std::uint32_t b = after_[i];
    return std::none_of(reflex_.begin(), reflex_.end(), [&](std::uint32_t r) {
      if (r == a || r == b || r == i) return false;
      if (points_[r] == points_[a] || points_[r] == points_[b] || points_[r] == points_[i]) return false;
      return area(a, i, r) >= 0.0 && area(i, b, r) >= 0.0 && area(b, a, r) >= 0.0;
    });
  }

  std::uint32_t widest(std::uint32_t at) const {
    std::uint32_t best = at;
    for (std::uint32_t i = after_[at]; i != at; i = after_[i])
      if (area(i) > area(best)) best = i;
    return best;
  }

  std::uint32_t cut(std::uint32_t i, std::vector<glm::uvec3>& triangles) {
    const std::uint32_t a = before_[i];
    const std::uint32_t b = after_[i];
    triangles.emplace_back(a, i, b);
    after_[a] = b;
    before_[b] = a;
    --size_;
    std::erase_if(reflex_, [&](std::uint32_t r) { return r == i || ((r == a || r == b) && area(r) > straight_); });
    return b;
  }

  std::size_t size_;
  std::vector<glm::dvec2> points_;
  std::vector<std::uint32_t> before_;
  std::vector<std::uint32_t> after_;
  std::vector<std::uint32_t> reflex_;  ///< corners that aren't convex: only they can lie within an ear
  double straight_ = 0.0;
};

}  // namespace

void triangulate(std::span<const glm::dvec3> corners, std::vector<glm::uvec3>& triangles) {
  if (corners.size() < 3) return;
  const glm::dvec3 normal = area_vector(corners);
  if (corners.size() == 3) {
    triangles.emplace_back(0, 1, 2);
  } else if (!(glm::dot(normal, normal) > 0.0)) {  // flat or balanced: any split is as good
    for (std::uint32_t i = 2; i < corners.size(); ++i) triangles.emplace_back(0, i - 1, i);
  } else if (corners.size() == 4) {
    split_quad(corners, normal, triangles);
  } else {
    Ring(corners, normal).cut_all(triangles);
  }
}

}  // namespace parian
