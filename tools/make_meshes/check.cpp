// What a mesh must be: closed, outward, free of self-intersections, made of well-shaped triangles.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "surface.h"

namespace make_meshes {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

double smallest_angle(glm::dvec3 a, glm::dvec3 b, glm::dvec3 c) {
  const auto angle = [](glm::dvec3 u, glm::dvec3 v) {
    return std::atan2(glm::length(glm::cross(u, v)), glm::dot(u, v));
  };
  return std::min({angle(b - a, c - a), angle(c - b, a - b), angle(a - c, b - c)}) * 180.0 / std::numbers::pi;
}

bool intersects_itself(const Mesh& mesh) {
  CGAL::Surface_mesh<Kernel::Point_3> surface;
  for (const glm::dvec3 p : mesh.points) surface.add_vertex({p.x, p.y, p.z});
  using Vertex = CGAL::Surface_mesh<Kernel::Point_3>::Vertex_index;
  for (const auto& t : mesh.triangles) {
    if (surface.add_face(Vertex(t[0]), Vertex(t[1]), Vertex(t[2])) == surface.null_face()) return true;
  }
  return CGAL::Polygon_mesh_processing::does_self_intersect(surface);
}

}  // namespace

Report check(const Mesh& mesh) {
  Report report{};
  report.low = glm::dvec3(1e300);
  report.high = glm::dvec3(-1e300);
  for (const glm::dvec3 p : mesh.points) report.low = glm::min(report.low, p), report.high = glm::max(report.high, p);

  std::vector<unsigned> part(mesh.points.size());
  std::iota(part.begin(), part.end(), 0u);
  const auto root = [&](unsigned v) {
    while (part[v] != v) v = part[v] = part[part[v]];
    return v;
  };
  std::vector<double> angles;
  std::map<std::pair<unsigned, unsigned>, int> edges;  // directed
  std::vector<std::map<unsigned, unsigned>> fans(mesh.points.size());
  report.closed = true;
  for (const auto& t : mesh.triangles) {
    const glm::dvec3 a = mesh.points[t[0]], b = mesh.points[t[1]], c = mesh.points[t[2]];
    report.area += 0.5 * glm::length(glm::cross(b - a, c - a));
    report.volume += glm::dot(a, glm::cross(b, c)) / 6.0;
    angles.push_back(smallest_angle(a, b, c));
    for (int i = 0; i < 3; ++i) {
      const unsigned u = t[i], v = t[(i + 1) % 3], w = t[(i + 2) % 3];
      if (++edges[{u, v}] > 1) report.closed = false;
      fans[u][v] = w;
      part[root(u)] = root(v);
    }
  }
  for (const auto& [edge, count] : edges) {
    if (!edges.contains({edge.second, edge.first})) report.closed = false;
  }
  for (const auto& fan : fans) {  // one walk round the vertex must meet all its triangles
    if (fan.empty()) {
      report.closed = false;
      continue;
    }
    std::size_t steps = 0;
    unsigned v = fan.begin()->first;
    do {
      const auto next = fan.find(v);
      if (next == fan.end()) break;
      v = next->second;
    } while (++steps < fan.size() && v != fan.begin()->first);
    if (steps != fan.size()) report.closed = false;
  }
  for (unsigned v = 0; v < part.size(); ++v) report.parts += root(v) == v;
  const long euler = static_cast<long>(mesh.points.size()) - static_cast<long>(edges.size() / 2) +
                     static_cast<long>(mesh.triangles.size());
  report.genus = static_cast<int>(report.parts - euler / 2);
  std::sort(angles.begin(), angles.end());
  report.least_angle = angles.front();
  report.least_angle_p1 = angles[angles.size() / 100];
  report.self_intersecting = intersects_itself(mesh);
  return report;
}

}  // namespace make_meshes
