// Area and box of each part, by union-find, and how large a pixel is where it lies.
#include "io/thin_parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/words.hpp"
#include "scene/box.hpp"
#include "scene/union_find.hpp"

namespace parian {
namespace {

constexpr double apart = 0.125;  // pixels, between subpixel positions

struct Part {
  Box<> box;
  double area = 0;
};

std::vector<Part> parts_of(const Mesh& mesh) {
  std::vector<std::uint32_t> number(mesh.positions.size(), 0);  // of each point's part
  std::uint32_t count = 1;
  if (mesh.counts.parts != 1) {  // those may touch in points
    UnionFind sets(mesh.positions.size());
    for (const glm::uvec3& t : mesh.triangles) {
      sets.join(t.x, t.y);
      sets.join(t.x, t.z);
    }
    count = 0;
    for (std::uint32_t i = 0; i < number.size(); ++i) {
      const std::uint32_t lowest = sets.find(i);
      number[i] = lowest == i ? count++ : number[lowest];
    }
  }
  std::vector<Part> parts(count);
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a = mesh.positions[t.x], b = mesh.positions[t.y], c = mesh.positions[t.z];
    Part& part = parts[number[t.x]];
    part.area += 0.5 * glm::length(glm::cross(b - a, c - a));
    for (const glm::dvec3& p : {a, b, c}) part.box.add(p);
  }
  std::erase_if(parts, [](const Part& part) { return !(part.area > 0); });
  return parts;
}

}  // namespace

std::string thin_parts_warning(const Scene& scene) {
  const std::vector<Part> parts = parts_of(scene.mesh);
  const double sides = scene.mesh.counts.boundary_edges > 0 ? 1 : 4;  // of a part that its area is divided between
  std::size_t thin = 0, thinnest_in = 0;
  double thinnest = INFINITY;
  for (const Part& part : parts) {
    const double length = glm::length(part.box.size()), width = part.area / (sides * length);
    bool missed = false;
    for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
      const Camera& camera = scene.cameras[i];
      const double distance = glm::length(0.5 * (part.box.low + part.box.high) - camera.eye);
      const double pixel = 2 * distance * std::tan(glm::radians(0.5 * camera.fov)) / scene.film.y;
      if (!(length > pixel) || !(width < apart * pixel)) continue;
      missed = true;
      if (width / pixel < thinnest) {
        thinnest = width / pixel;
        thinnest_in = i + 1;
      }
    }
    thin += missed;
  }
  if (thin == 0) return {};
  return fmt::format(
      "{} of {} part{} thinner than subpixel positions lie apart, the thinnest {:.2g} pixels wide in camera {}: they "
      "may "
      "be missing in the picture, in places or altogether; use a larger {} or come closer",
      thin, parts.size(), parts.size() == 1 ? " is" : "s are", thinnest, thinnest_in, setting("film"));
}

}  // namespace parian
