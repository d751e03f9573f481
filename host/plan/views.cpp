// Where views stand: fitted orthographic films, pinholes, and the greedy choice of layer directions.
#include "plan/views.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "core/error.hpp"
#include "scene/box.hpp"

namespace parian {
namespace {

constexpr std::uint64_t largest_camera_layer = 1 << 20;  // texels
constexpr double guard_pixels = 30000.0;                 // the kernels' guard band is 2^15 pixels around the axis

}  // namespace

ObjectSpace object_space(const std::vector<glm::dvec3>& positions) {
  Box box;
  for (const auto& p : positions) box.add(p);
  ObjectSpace space{0.5 * (box.low + box.high), 0.0};
  double radius2 = 0.0;
  for (const auto& p : positions) radius2 = std::max(radius2, glm::dot(p - space.centre, p - space.centre));
  space.radius = std::sqrt(radius2);
  if (!(space.radius > 0.0) || !std::isfinite(space.radius))
    throw Error(ErrorKind::input, "the object has no extent; scale it up or check its coordinates");
  return space;
}

kernels::View orthographic_view(const std::vector<glm::dvec3>& points, glm::dvec3 towards, std::uint32_t size) {
  const glm::dvec3 back = glm::normalize(towards);
  const glm::dvec3 helper = std::abs(back.y) < 0.99 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1);
  const glm::dvec3 right = glm::normalize(glm::cross(helper, back));
  const glm::dvec3 down = -glm::cross(back, right);
  Box<glm::dvec2> box;
  for (const auto& p : points) box.add({glm::dot(p, right), glm::dot(p, down)});
  const double extent = std::max({box.size().x, box.size().y, 1e-6});
  kernels::View v{};
  v.right = to_float4(right);
  v.down = to_float4(down);
  v.back = to_float4(back);
  const double margin = size > 4 ? 2.0 : 0.0;
  const double scale = (static_cast<double>(size) - margin) / extent;
  v.scale = static_cast<float>(scale);
  v.centre_x = static_cast<float>(0.5 * size - scale * 0.5 * (box.low.x + box.high.x));
  v.centre_y = static_cast<float>(0.5 * size - scale * 0.5 * (box.low.y + box.high.y));
  v.width = v.height = size;
  return v;
}

std::vector<glm::dvec3> sphere_points() {
  constexpr std::size_t count = 1024;
  constexpr double outside = 1.004;  // so that what lies between the points is held, too
  std::vector<glm::dvec3> points = even_directions(count);
  for (glm::dvec3& p : points) p *= outside;
  return points;
}

kernels::View pinhole_view(const Camera& camera, const ObjectSpace& space, glm::uvec2 film) {
  const glm::dvec3 eye = (camera.eye - space.centre) / space.radius;
  const glm::dvec3 back = glm::normalize(camera.eye - camera.target);
  glm::dvec3 right = glm::cross(camera.up, back);
  if (!(glm::length(right) > 1e-9 * glm::length(camera.up)))
    right = glm::cross(std::abs(back.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1), back);
  right = glm::normalize(right);
  kernels::View v{};
  v.origin = to_float4(eye);
  v.right = to_float4(right);
  v.down = to_float4(-glm::cross(back, right));
  v.back = to_float4(back);
  v.scale = static_cast<float>(0.5 * film.y / std::tan(0.5 * camera.fov * std::numbers::pi / 180.0));
  v.centre_x = 0.5F * static_cast<float>(film.x);
  v.centre_y = 0.5F * static_cast<float>(film.y);
  v.near_distance = static_cast<float>(std::max(1e-4 * glm::length(eye), 1e-6));
  v.width = film.x;
  v.height = film.y;
  return v;
}

kernels::View camera_layer(kernels::View camera) {
  while (std::uint64_t{camera.width} * camera.height > largest_camera_layer) {
    camera.scale *= 0.5F;
    camera.centre_x *= 0.5F;
    camera.centre_y *= 0.5F;
    camera.width = (camera.width + 1) / 2;
    camera.height = (camera.height + 1) / 2;
  }
  return camera;
}

bool centre_in_film(const kernels::View& v) {
  const auto along = [&](const kernels::float4& axis) {  // from the camera to the centre, which is 0
    return -(double{v.origin.x} * axis.x + double{v.origin.y} * axis.y + double{v.origin.z} * axis.z);
  };
  const double depth = -along(v.back);
  if (!(depth > 0.0)) return false;
  const double x = v.centre_x + v.scale * along(v.right) / depth, y = v.centre_y + v.scale * along(v.down) / depth;
  return x >= 0.0 && y >= 0.0 && x < v.width && y < v.height;
}

bool needs_clipping(const kernels::View& v) {
  const double distance = std::hypot(v.origin.x, v.origin.y, v.origin.z);
  // Depth along the axis, not distance: the object may lie beside or behind a camera that looks elsewhere.
  const double depth = double{v.origin.x} * v.back.x + double{v.origin.y} * v.back.y + double{v.origin.z} * v.back.z;
  const double nearest = depth - 1.0;
  return nearest <= 2.0 * v.near_distance || v.scale * (1.0 + distance) / nearest > guard_pixels;
}

std::vector<glm::dvec3> even_directions(std::size_t count) {
  std::vector<glm::dvec3> directions(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double y = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / static_cast<double>(count);
    const double r = std::sqrt(1.0 - y * y), phi = static_cast<double>(i) * std::numbers::pi * (3.0 - std::sqrt(5.0));
    directions[i] = {r * std::cos(phi), y, r * std::sin(phi)};
  }
  return directions;
}

SurfacePoints surface_points(const std::vector<glm::dvec3>& positions, const std::vector<glm::uvec3>& triangles,
                             std::size_t count) {
  // In the order of their places, so that a mesh's own order of triangles doesn't move the points.
  const auto sum = [&](std::uint32_t t) {
    return positions[triangles[t].x] + positions[triangles[t].y] + positions[triangles[t].z];
  };
  struct Place {
    double x;  // of sum: decides nearly always
    std::uint32_t triangle;
  };
  std::vector<Place> places(triangles.size());
  for (std::uint32_t t = 0; t < places.size(); ++t) places[t] = {sum(t).x, t};
  std::sort(places.begin(), places.end(), [&](const Place& p, const Place& q) {
    if (p.x != q.x) return p.x < q.x;
    const glm::dvec3 a = sum(p.triangle), b = sum(q.triangle);
    return std::tie(a.y, a.z, p.triangle) < std::tie(b.y, b.z, q.triangle);
  });
  double area = 0.0;
  for (Place& p : places) {
    const glm::dvec3 a = positions[triangles[p.triangle].x];
    area +=
        0.5 * glm::length(glm::cross(positions[triangles[p.triangle].y] - a, positions[triangles[p.triangle].z] - a));
    p.x = area;  // from here on: cumulated
  }
  SurfacePoints points;
  std::size_t t = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double at = area * (static_cast<double>(i) + 0.5) / static_cast<double>(count);
    while (t + 1 < places.size() && places[t].x < at) ++t;
    const glm::uvec3& corners = triangles[places[t].triangle];
    const glm::dvec3 a = positions[corners.x], b = positions[corners.y], c = positions[corners.z];
    double u = std::fmod(static_cast<double>(i) * 0.7548776662466927, 1.0);
    double v = std::fmod(static_cast<double>(i) * 0.5698402909980532, 1.0);
    if (u + v > 1.0) {
      u = 1.0 - u;
      v = 1.0 - v;
    }
    points.x.push_back(a + u * (b - a) + v * (c - a));
    points.n.push_back(glm::normalize(glm::cross(b - a, c - a)));
  }
  return points;
}

std::vector<std::size_t> choose_directions(const std::vector<std::vector<float>>& quality, std::size_t count,
                                           bool complete) {
  const std::size_t points = quality.empty() ? 0 : quality.front().size();
  // Being seen at all is worth 1, head-on a little more: coverage first, then resolution. In integers, whose sums
  // compilers vectorise: at most 1.5 x 2^14 a point.
  std::vector<std::vector<std::int32_t>> worth;
  for (const std::vector<float>& cosines : quality) {
    std::vector<std::int32_t>& of_points = worth.emplace_back();
    for (const float cosine : cosines)
      of_points.push_back(static_cast<std::int32_t>((cosine > 0.1F ? 1.0F + 0.5F * cosine : cosine) * 0x1p14F));
  }
  std::vector<std::int32_t> best(points, 0);
  std::vector<std::size_t> chosen;
  std::vector<bool> used(quality.size(), false);
  for (std::size_t k = 0; k < std::min(count, quality.size()); ++k) {
    std::size_t winner = 0;
    std::int32_t most = -1;
    for (std::size_t c = 0; c < quality.size(); ++c) {
      if (used[c]) continue;
      std::int32_t gain = 0;
      for (std::size_t p = 0; p < points; ++p) gain += std::max(worth[c][p] - best[p], 0);
      if (gain > most) {
        most = gain;
        winner = c;
      }
    }
    if (most == 0 && k > 0 && !complete) break;
    used[winner] = true;
    chosen.push_back(winner);
    for (std::size_t p = 0; p < points; ++p) best[p] = std::max(best[p], worth[winner][p]);
  }
  return chosen;
}

}  // namespace parian
