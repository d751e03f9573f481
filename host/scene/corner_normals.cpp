// Angle-weighted sums over fans, and the angles between neighbours.
#include "scene/corner_normals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/parallel.hpp"
#include "scene/box.hpp"
#include "scene/union_find.hpp"

namespace parian {
namespace {

std::uint32_t next(std::uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
std::uint32_t previous(std::uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }

/// Calls `work(i)` for each i below `count`, on all processors if there are many.
void in_blocks(std::size_t count, const auto& work) {
  constexpr std::size_t block = 1 << 16;
  in_parallel((count + block - 1) / block, 0, [&](std::size_t b) {
    for (std::size_t i = b * block; i < std::min(count, (b + 1) * block); ++i) work(i);
  });
}

struct Places {
  const glm::dvec3 &a, &b, &c;
};
Places places_of(const Mesh& mesh, std::size_t triangle) {
  const glm::uvec3& t = mesh.triangles[triangle];
  return {mesh.positions[t.x], mesh.positions[t.y], mesh.positions[t.z]};
}

/// Numbers fans by their first corners; returns each corner's.
std::vector<std::uint32_t> find_fans(const Topology& topology, const std::vector<glm::dvec3>& flat, double smooth,
                                     std::uint32_t& count) {
  std::vector<std::uint32_t> mates = topology.mates;  // none across creases
  for (std::uint32_t h = 0; h < mates.size(); ++h) {
    const std::uint32_t mate = mates[h];
    if (mate == no_mate || mate < h || !(glm::dot(flat[h / 3], flat[mate / 3]) < smooth)) continue;
    mates[h] = mates[mate] = no_mate;
  }
  constexpr std::uint32_t none = no_mate;
  std::vector<std::uint32_t> fans(mates.size(), none);
  for (std::uint32_t start = 0; start < fans.size(); ++start) {
    if (fans[start] != none) continue;
    std::uint32_t h = start;
    do {  // round the point one way
      fans[h] = count;
      h = mates[h] == no_mate ? no_mate : next(mates[h]);
    } while (h != start && h != no_mate);
    if (h == no_mate)  // and the other
      for (h = start; (h = mates[previous(h)]) != no_mate;) fans[h] = count;
    ++count;
  }
  return fans;
}

/// The angle between two edges, in radians.
double angle_between(const glm::dvec3& e, const glm::dvec3& f) {
  return std::atan2(glm::length(glm::cross(e, f)), glm::dot(e, f));
}

/// What the corners of a fan add up to.
struct Fan {
  glm::dvec3 sum{0.0}, normal{0.0};
  double length = 0.0;
};

/// Looks for facets: edges that corner normals smooth, with an angle between triangles that both reach far from them.
class Facets {
 public:
  Facets(const Topology& topology, const std::vector<glm::dvec3>& flat, const Mesh& mesh)
      : topology_(topology), flat_(flat), mesh_(mesh) {
    Box box;
    for (const glm::dvec3& p : mesh.positions) box.add(p);
    reach_ = large * longest(box.size());
  }

  [[nodiscard]] double area(std::uint32_t triangle) const {
    const glm::dvec3 a = corner(3 * triangle);
    return 0.5 * glm::length(glm::cross(corner(3 * triangle + 1) - a, corner(3 * triangle + 2) - a));
  }

  /// A triangle's largest angle of that kind, in degrees; 0 where there is none above the least that counts.
  [[nodiscard]] double angle(std::uint32_t triangle) const {
    double least = 1.0;
    for (std::uint32_t h = 3 * triangle; h < 3 * triangle + 3; ++h) {
      const std::uint32_t mate = topology_.mates[h];
      if (mate == no_mate) continue;
      const double cosine = glm::dot(flat_[triangle], flat_[mate / 3]);
      if (cosine > flat_enough || cosine > least || !is_smoothed(h, mate)) continue;
      const double edge = glm::distance(corner(h), corner(next(h)));
      if (2.0 * std::min(area(triangle), area(mate / 3)) >= reach_ * edge) least = cosine;
    }
    return std::acos(std::clamp(least, -1.0, 1.0)) * 180.0 / std::numbers::pi;
  }

 private:
  static constexpr double large = 1.0 / 25;      // reach from the edge, of the box's longest side
  static constexpr double flat_enough = 0.9903;  // cosine of 8 degrees

  [[nodiscard]] const glm::dvec3& corner(std::uint32_t h) const {
    return mesh_.positions[mesh_.triangles[h / 3][static_cast<int>(h % 3)]];
  }
  [[nodiscard]] bool is_smoothed(std::uint32_t h, std::uint32_t mate) const {
    constexpr float same = 0.9998F;  // one degree
    const auto& n = mesh_.normals;
    return glm::dot(n[h], n[next(mate)]) > same && glm::dot(n[next(h)], n[mate]) > same;
  }

  const Topology& topology_;
  const std::vector<glm::dvec3>& flat_;
  const Mesh& mesh_;
  double reach_ = 0.0;
};

}  // namespace

std::vector<glm::dvec3> flat_normals(const Mesh& mesh) {
  std::vector<glm::dvec3> flat(mesh.triangles.size());
  in_blocks(flat.size(), [&](std::size_t t) {
    const auto& [a, b, c] = places_of(mesh, t);
    flat[t] = glm::cross(b - a, c - a);
    flat[t] /= glm::length(flat[t]);
  });
  return flat;
}

void compute_normals(const Topology& topology, const std::vector<glm::dvec3>& flat, double crease_degrees, Mesh& mesh) {
  const double smooth = std::cos(crease_degrees * std::numbers::pi / 180.0);
  std::uint32_t count = 0;
  const std::vector<std::uint32_t> fan_of = find_fans(topology, flat, smooth, count);
  std::vector<glm::dvec3> angles(flat.size());  // of triangles
  in_blocks(angles.size(), [&](std::size_t t) {
    const auto& [a, b, c] = places_of(mesh, t);
    angles[t] = {angle_between(b - a, c - a), angle_between(c - b, a - b), angle_between(a - c, b - c)};
  });
  std::vector<Fan> fans(count);
  for (std::size_t t = 0; t < flat.size(); ++t) {
    fans[fan_of[3 * t]].sum += angles[t].x * flat[t];
    fans[fan_of[3 * t + 1]].sum += angles[t].y * flat[t];
    fans[fan_of[3 * t + 2]].sum += angles[t].z * flat[t];
  }
  for (Fan& fan : fans) {
    fan.length = glm::length(fan.sum);
    fan.normal = fan.sum / fan.length;
  }
  mesh.normals.resize(fan_of.size());
  in_blocks(fan_of.size(), [&](std::size_t h) {
    const Fan& fan = fans[fan_of[h]];
    // A fan that curls round may cancel, or bend away from one of its triangles: that corner stays flat.
    const bool usable = glm::dot(fan.sum, flat[h / 3]) > 1e-6 * fan.length;
    mesh.normals[h] = glm::vec3(usable ? fan.normal : flat[h / 3]);
  });
}

void use_given_normals(const std::vector<glm::vec3>& given, const std::vector<glm::uvec3>& ids,
                       const Topology& topology, const std::vector<glm::dvec3>& flat, Mesh& mesh) {
  const auto given_at = [&](std::size_t h) {
    const std::uint32_t id = ids[h / 3][static_cast<int>(h % 3)];
    const glm::dvec3 n = id == no_normal ? glm::dvec3(0.0) : glm::dvec3(given[id]);
    const double length = glm::length(n);
    return length > 0.0 && std::isfinite(length) ? n / length : glm::dvec3(0.0);
  };
  const std::size_t corners = 3 * mesh.triangles.size();
  std::vector<double> outward(topology.closed.size(), 0.0);  // of each part
  for (std::size_t h = 0; h < corners; ++h) outward[topology.parts[h / 3]] += glm::dot(given_at(h), flat[h / 3]);
  std::size_t missing = 0;
  for (std::size_t h = 0; h < corners; ++h) {
    const glm::dvec3 n = outward[topology.parts[h / 3]] < 0.0 ? -given_at(h) : given_at(h);
    if (glm::dot(n, flat[h / 3]) > 1e-6)
      mesh.normals[h] = glm::vec3(n);
    else
      ++missing;
  }
  if (missing > 0)
    mesh.warnings.push_back(
        fmt::format("of {} corners {} have no normal, or one that isn't finite or faces away: "
                    "computed ones are used there; mend the file's normals or leave them out",
                    corners, missing));
}

std::string facets_warning(const Topology& topology, const std::vector<glm::dvec3>& flat, const Mesh& mesh) {
  constexpr std::size_t fine = 500000;  // triangles, of which large ones can't be much of the surface
  constexpr double least_share = 0.25;  // of the surface
  if (mesh.triangles.size() > fine) return {};
  const Facets facets(topology, flat, mesh);
  double whole = 0.0, faceted = 0.0;
  std::vector<std::pair<double, double>> angles;  // of faceted triangles, with their areas
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const double angle = facets.angle(t), area = facets.area(t);
    whole += area;
    if (angle == 0.0) continue;
    faceted += area;
    angles.emplace_back(angle, area);
  }
  if (!(faceted >= least_share * whole)) return {};
  std::sort(angles.begin(), angles.end());
  double below = 0.0;
  const auto typical = std::find_if(angles.begin(), angles.end() - 1, [&](const auto& angle) {
    below += angle.second;
    return below >= 0.5 * faceted;
  });
  return fmt::format(
      "coarse mesh: {:.0f} degrees between neighbouring triangles, over {:.0f} % of the surface: facets "
      "will show, as light arrives by flat triangles; subdivide it",
      typical->first, 100.0 * faceted / whole);
}

}  // namespace parian
