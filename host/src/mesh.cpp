// clean_mesh: from polygons as a file has them to triangles that the passes can trust.
#include "mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "error.hpp"
#include "mesh_topology.hpp"
#include "triangulate.hpp"
#include "union_find.hpp"

namespace parian {
namespace {

[[noreturn]] void refuse(const std::string& message) { throw Error(ErrorKind::input, "mesh: " + message); }

void check(const PolygonMesh& polygons) {
  if (polygons.face_sizes.empty()) refuse("it has no faces; choose another mesh");
  if (polygons.points.size() >= no_mate || polygons.corners.size() >= no_mate / 3)
    refuse("it has more points or corners than 32-bit indices reach; simplify it");
  std::size_t corners = 0;
  for (std::size_t i = 0; i < polygons.face_sizes.size(); ++i) {
    if (polygons.face_sizes[i] < 3) refuse(fmt::format("face {} has {} corners; remove it", i, polygons.face_sizes[i]));
    corners += polygons.face_sizes[i];
  }
  if (corners != polygons.corners.size())
    refuse(fmt::format("its faces need {} corners, but it has {}; correct it", corners, polygons.corners.size()));
  for (const std::uint32_t corner : polygons.corners)
    if (corner >= polygons.points.size())
      refuse(fmt::format("a face names point {} of {}; correct the index", corner, polygons.points.size()));
  for (std::size_t i = 0; i < polygons.points.size(); ++i) {
    const glm::dvec3& p = polygons.points[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
      refuse(fmt::format("point {} is ({}, {}, {}); remove it", i, p.x, p.y, p.z));
  }
}

/// For each point the lowest point at the same position.
std::vector<std::uint32_t> join_points(const std::vector<glm::dvec3>& points) {
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](std::uint32_t i, std::uint32_t j) {
    const glm::dvec3& a = points[i];
    const glm::dvec3& b = points[j];
    if (a.x != b.x) return a.x < b.x;
    if (a.y != b.y) return a.y < b.y;
    if (a.z != b.z) return a.z < b.z;
    return i < j;
  });
  std::vector<std::uint32_t> joined(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && points[order[i]] == points[order[i - 1]];
    joined[order[i]] = same ? joined[order[i - 1]] : order[i];
  }
  return joined;
}

/// Whether a triangle's area is no more than rounding: the cross product of edges up to length L carries an error of
/// about 8 eps L^2 in double, so below 16 eps L^2 even its direction is noise. Free of scale and of position.
bool has_no_area(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const double longest = std::max({glm::dot(b - a, b - a), glm::dot(c - b, c - b), glm::dot(a - c, a - c)});
  return !(glm::length(glm::cross(b - a, c - a)) > 16.0 * std::numeric_limits<double>::epsilon() * longest);
}

/// Triangles without area but with three different corners often close the seam between one edge and two shorter ones,
/// in CAD exports above all; to drop them would open the mesh. So the triangle across their longest edge is split at
/// the third corner instead, where both halves have an area. Chains of them need a few passes.
void absorb_slivers(const std::vector<glm::dvec3>& points, std::vector<glm::uvec3>& triangles) {
  const auto is_sliver = [&](const glm::uvec3& t) { return has_no_area(points[t[0]], points[t[1]], points[t[2]]); };
  constexpr int passes = 32;
  bool progress = std::any_of(triangles.begin(), triangles.end(), is_sliver);
  for (int pass = 0; pass < passes && progress; ++pass) {
    progress = false;
    const std::vector<std::uint32_t> mates = find_topology(triangles, points.size()).mates;
    std::vector<bool> touched(triangles.size(), false);
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      const glm::uvec3 s = triangles[t];
      if (touched[t] || !is_sliver(s)) continue;
      const auto edge = [&](std::uint32_t k) { return glm::distance(points[s[k]], points[s[(k + 1) % 3]]); };
      const std::uint32_t k = edge(0) >= edge(1) && edge(0) >= edge(2) ? 0 : edge(1) >= edge(2) ? 1 : 2;
      const std::uint32_t mate = mates[3 * t + k];
      if (mate == no_mate || touched[mate / 3]) continue;
      const std::uint32_t middle = s[(k + 2) % 3];
      const std::uint32_t apex = triangles[mate / 3][(mate % 3 + 2) % 3];
      const glm::uvec3 first(s[k], apex, middle);
      const glm::uvec3 second(apex, s[(k + 1) % 3], middle);
      if (apex == middle || is_sliver(first) || is_sliver(second)) continue;
      triangles[t] = first;
      triangles[mate / 3] = second;
      touched[t] = touched[mate / 3] = progress = true;
    }
  }
}

/// Triangles of all faces, with joined points, without those that have no area.
std::vector<glm::uvec3> make_triangles(const PolygonMesh& polygons, const std::vector<std::uint32_t>& joined,
                                       MeshCounts& counts) {
  std::vector<glm::uvec3> triangles;
  triangles.reserve(polygons.corners.size() - 2 * polygons.face_sizes.size());
  std::vector<std::uint32_t> face;
  std::vector<glm::dvec3> corners;
  std::vector<glm::uvec3> pieces;
  std::size_t begin = 0;
  for (const std::uint32_t size : polygons.face_sizes) {
    face.clear();
    for (std::size_t i = begin; i < begin + size; ++i) {
      const std::uint32_t point = joined[polygons.corners[i]];
      if (face.empty() || face.back() != point) face.push_back(point);
    }
    while (face.size() > 1 && face.front() == face.back()) face.pop_back();
    begin += size;
    if (face.size() < 3) {
      ++counts.zero_area_faces;
      continue;
    }
    corners.clear();
    for (const std::uint32_t point : face) corners.push_back(polygons.points[point]);
    pieces.clear();
    triangulate(corners, pieces);
    for (const glm::uvec3& t : pieces) {
      const glm::uvec3 triangle(face[t[0]], face[t[1]], face[t[2]]);
      if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0])
        ++counts.zero_area_faces;
      else
        triangles.push_back(triangle);
    }
  }
  absorb_slivers(polygons.points, triangles);
  counts.zero_area_faces += std::erase_if(triangles, [&](const glm::uvec3& t) {
    return has_no_area(polygons.points[t[0]], polygons.points[t[1]], polygons.points[t[2]]);
  });
  if (triangles.empty()) refuse("none of its triangles has an area; choose another mesh");
  return triangles;
}

/// Keeps the points that triangles use, numbers them anew, and counts the others.
void keep_used_points(const PolygonMesh& polygons, const std::vector<std::uint32_t>& joined, Mesh& mesh) {
  constexpr std::uint32_t unused = no_mate;
  std::vector<bool> named(polygons.points.size(), false);
  for (const std::uint32_t corner : polygons.corners) named[corner] = true;
  std::vector<bool> used(polygons.points.size(), false);
  for (const glm::uvec3& t : mesh.triangles) used[t[0]] = used[t[1]] = used[t[2]] = true;
  std::vector<std::uint32_t> number(polygons.points.size(), unused);
  for (std::size_t i = 0; i < polygons.points.size(); ++i) {
    if (!used[joined[i]]) continue;
    if (number[joined[i]] == unused) {
      number[joined[i]] = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.positions.push_back(polygons.points[joined[i]]);
    } else if (named[i]) {
      ++mesh.counts.duplicate_points;
    }
  }
  mesh.counts.unreferenced_points = polygons.points.size() - mesh.positions.size() - mesh.counts.duplicate_points;
  for (glm::uvec3& t : mesh.triangles) t = {number[t[0]], number[t[1]], number[t[2]]};
}

/// Angle-weighted normals. A corner's fan is what can be reached from its triangle across edges below the crease angle;
/// edges at the boundary or with more than two triangles, or two that disagree, always end it.
void compute_normals(const Topology& topology, double crease_degrees, Mesh& mesh) {
  const std::vector<glm::uvec3>& triangles = mesh.triangles;
  std::vector<glm::dvec3> flat(triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const glm::dvec3 a = mesh.positions[triangles[t][0]];
    flat[t] = glm::cross(mesh.positions[triangles[t][1]] - a, mesh.positions[triangles[t][2]] - a);
    flat[t] /= glm::length(flat[t]);
  }
  const double smooth = std::cos(crease_degrees * std::numbers::pi / 180.0);
  const auto next = [](std::uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; };
  UnionFind fans(3 * triangles.size());
  for (std::uint32_t h = 0; h < topology.mates.size(); ++h) {
    const std::uint32_t mate = topology.mates[h];
    if (mate == no_mate || mate < h || glm::dot(flat[h / 3], flat[mate / 3]) < smooth) continue;
    fans.join(h, next(mate));
    fans.join(next(h), mate);
  }
  std::vector<std::uint32_t> fan(3 * triangles.size());  // of each corner, numbered by their first corners
  std::uint32_t count = 0;
  for (std::uint32_t h = 0; h < fan.size(); ++h) {
    const std::uint32_t root = fans.find(h);
    fan[h] = root == h ? count++ : fan[root];
  }
  std::vector<glm::dvec3> sums(count, glm::dvec3(0.0));
  for (std::uint32_t h = 0; h < fan.size(); ++h) {
    const glm::uvec3& t = triangles[h / 3];
    const glm::dvec3 at = mesh.positions[t[h % 3]];
    const glm::dvec3 e = mesh.positions[t[(h + 1) % 3]] - at;
    const glm::dvec3 f = mesh.positions[t[(h + 2) % 3]] - at;
    sums[fan[h]] += std::atan2(glm::length(glm::cross(e, f)), glm::dot(e, f)) * flat[h / 3];
  }
  mesh.normals.resize(fan.size());
  for (std::uint32_t h = 0; h < fan.size(); ++h) {
    const glm::dvec3& sum = sums[fan[h]];
    // A fan that curls round may cancel, or bend away from one of its triangles: that corner stays flat.
    const bool usable = glm::dot(sum, flat[h / 3]) > 1e-6 * glm::length(sum);
    mesh.normals[h] = glm::vec3(usable ? sum / glm::length(sum) : flat[h / 3]);
  }
}

}  // namespace

Mesh clean_mesh(PolygonMesh polygons, double crease_degrees) {
  check(polygons);
  Mesh mesh;
  MeshCounts& counts = mesh.counts;
  counts.faces_read = polygons.face_sizes.size();
  counts.points_read = polygons.points.size();
  std::vector<std::uint32_t> joined = join_points(polygons.points);
  mesh.triangles = make_triangles(polygons, joined, counts);
  counts.triangles = mesh.triangles.size();
  keep_used_points(polygons, joined, mesh);
  polygons = {};  // at millions of triangles each copy counts
  joined = {};
  Topology topology = find_topology(mesh.triangles, mesh.positions.size());
  counts.parts_turned = orient_closed_parts(mesh.positions, mesh.triangles, topology);
  counts.boundary_edges = topology.boundary_edges;
  counts.non_manifold_edges = topology.non_manifold_edges;
  counts.parts = topology.closed.size();
  mesh.closed = counts.boundary_edges == 0 && counts.non_manifold_edges == 0;
  compute_normals(topology, crease_degrees, mesh);
  if (counts.boundary_edges > 0)
    mesh.warnings.push_back(fmt::format(
        "the mesh is open ({} boundary edges): it bounds no volume, so treat results near its edges with care",
        counts.boundary_edges));
  if (counts.non_manifold_edges > 0)
    mesh.warnings.push_back(fmt::format(
        "{} edges have more than two triangles, or two that disagree: inside and outside aren't clear there",
        counts.non_manifold_edges));
  return mesh;
}

}  // namespace parian
