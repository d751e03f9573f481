// clean_mesh: from polygons as a file has them to triangles that the passes can trust.
#include "scene/mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/error.hpp"
#include "scene/corner_normals.hpp"
#include "scene/mesh_topology.hpp"
#include "scene/triangulate.hpp"

namespace parian {
namespace {

[[noreturn]] void refuse(const std::string& message) { throw Error(ErrorKind::input, "mesh: " + message); }

void check_given_normals(const PolygonMesh& polygons) {
  const std::vector<std::uint32_t>& corners = polygons.corner_normals;
  if (corners.empty()) {
    if (!polygons.normals.empty() && polygons.normals.size() != polygons.points.size())
      refuse(fmt::format("it has {} points, but {} normals; leave them out", polygons.points.size(),
                         polygons.normals.size()));
    return;
  }
  if (corners.size() != polygons.corners.size())
    refuse(fmt::format("it has {} corners, but normals for {}; correct it", polygons.corners.size(), corners.size()));
  for (const std::uint32_t normal : corners)
    if (normal >= polygons.normals.size() && normal != no_normal)
      refuse(fmt::format("a face names normal {} of {}; correct the index", normal, polygons.normals.size()));
}

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
  check_given_normals(polygons);
  for (std::size_t i = 0; i < polygons.points.size(); ++i) {
    const glm::dvec3& p = polygons.points[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
      refuse(fmt::format("point {} is ({}, {}, {}); remove it", i, p.x, p.y, p.z));
  }
}

/// A number that hardly any two positions share, but equal ones do.
std::uint64_t hash_of(const glm::dvec3& position) {
  std::uint64_t hash = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double value = position[axis] + 0.0;  // -0 equals 0
    hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 0x9e3779b97f4a7c15U;
    hash ^= hash >> 32;
  }
  return hash;
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
/// Given normals, if there are any, go with their corners. False if there are no slivers.
bool absorb_slivers(const std::vector<glm::dvec3>& points, std::vector<glm::uvec3>& triangles,
                    std::vector<glm::uvec3>& normals) {
  const auto is_sliver = [&](const glm::uvec3& t) { return has_no_area(points[t[0]], points[t[1]], points[t[2]]); };
  constexpr int passes = 32;
  const bool any = std::any_of(triangles.begin(), triangles.end(), is_sliver);
  bool progress = any;
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
      if (!normals.empty()) {
        const glm::uvec3 own = normals[t], other = normals[mate / 3];
        const std::uint32_t end = mate % 3;  // where s[k + 1] is
        normals[t] = {other[(end + 1) % 3], other[(end + 2) % 3], own[(k + 2) % 3]};
        normals[mate / 3] = {other[(end + 2) % 3], other[end], own[(k + 2) % 3]};
      }
      triangles[t] = first;
      triangles[mate / 3] = second;
      touched[t] = touched[mate / 3] = progress = true;
    }
  }
  return any;
}

/// Removes the elements that `is_out` says, of both lists alike; the second may be empty. Returns how many.
std::size_t erase_both(std::vector<glm::uvec3>& triangles, std::vector<glm::uvec3>& normals, const auto& is_out) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (is_out(triangles[t])) continue;
    if (!normals.empty()) normals[kept] = normals[t];
    triangles[kept++] = triangles[t];
  }
  const std::size_t erased = triangles.size() - kept;
  triangles.resize(kept);
  if (!normals.empty()) normals.resize(kept);
  return erased;
}

/// Triangles of all faces, with joined points, without those that have no area; and which given normal each corner has,
/// if there are any.
std::vector<glm::uvec3> make_triangles(const PolygonMesh& polygons, const std::vector<std::uint32_t>& joined,
                                       std::vector<glm::uvec3>& normals, MeshCounts& counts) {
  std::vector<glm::uvec3> triangles;
  triangles.reserve(polygons.corners.size() - 2 * polygons.face_sizes.size());
  const auto point = [&](std::size_t corner) { return joined[polygons.corners[corner]]; };
  const auto normal = [&](std::size_t corner) {
    return polygons.corner_normals.empty() ? polygons.corners[corner] : polygons.corner_normals[corner];
  };
  const auto add = [&](std::size_t i, std::size_t j, std::size_t k) {  // corners
    const glm::uvec3 triangle(point(i), point(j), point(k));
    if (triangle.x == triangle.y || triangle.y == triangle.z || triangle.z == triangle.x) {
      ++counts.zero_area_faces;
      return;
    }
    triangles.push_back(triangle);
    if (!polygons.normals.empty()) normals.emplace_back(normal(i), normal(j), normal(k));
  };
  std::vector<std::size_t> face;  // its corners, without those that repeat the point of the one before
  std::vector<glm::dvec3> places;
  std::vector<glm::uvec3> pieces;
  std::size_t begin = 0;
  for (const std::uint32_t size : polygons.face_sizes) {
    const std::size_t first = begin;
    begin += size;
    if (size == 3) {
      add(first, first + 1, first + 2);
      continue;
    }
    face.clear();
    for (std::size_t i = first; i < begin; ++i)
      if (face.empty() || point(i) != point(face.back())) face.push_back(i);
    while (face.size() > 1 && point(face.front()) == point(face.back())) face.pop_back();
    if (face.size() < 3) {
      ++counts.zero_area_faces;
      continue;
    }
    places.clear();
    for (const std::size_t i : face) places.push_back(polygons.points[point(i)]);
    pieces.clear();
    triangulate(places, pieces);
    for (const glm::uvec3& t : pieces) add(face[t[0]], face[t[1]], face[t[2]]);
  }
  if (absorb_slivers(polygons.points, triangles, normals))
    counts.zero_area_faces += erase_both(triangles, normals, [&](const glm::uvec3& t) {
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
  mesh.positions.reserve(polygons.points.size());
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

/// Turns closed parts outward; given normals stay with their corners.
void orient(Topology& topology, std::vector<glm::uvec3>& normals, Mesh& mesh) {
  const std::vector<glm::uvec3> before = normals.empty() ? std::vector<glm::uvec3>() : mesh.triangles;
  mesh.counts.parts_turned = orient_closed_parts(mesh.positions, mesh.triangles, topology);
  for (std::size_t t = 0; t < normals.size(); ++t)
    if (before[t] != mesh.triangles[t]) std::swap(normals[t][1], normals[t][2]);
}

void add_warnings(const Topology& topology, const std::vector<glm::dvec3>& flat, Mesh& mesh) {
  const MeshCounts& counts = mesh.counts;
  if (counts.boundary_edges > 0)
    mesh.warnings.push_back(fmt::format(
        "the mesh is open ({} boundary edges): it bounds no volume, so treat results near its edges with care",
        counts.boundary_edges));
  if (counts.non_manifold_edges > 0)
    mesh.warnings.push_back(fmt::format(
        "{} edges have more than two triangles, or two that disagree: inside and outside aren't clear there",
        counts.non_manifold_edges));
  if (std::string line = nesting_warning(mesh.positions, mesh.triangles, topology); !line.empty())
    mesh.warnings.push_back(std::move(line));
  if (std::string line = facets_warning(topology, flat, mesh); !line.empty()) mesh.warnings.push_back(std::move(line));
}

}  // namespace

std::vector<std::uint32_t> join_points(const std::vector<glm::dvec3>& points) {
  constexpr std::uint32_t none = no_mate;
  const std::size_t places = std::bit_ceil(2 * points.size() + 2);
  const int shift = 64 - std::countr_zero(places);
  std::vector<std::uint32_t> table(places, none);  // of the lowest points, each from where its hash points on
  std::vector<std::uint32_t> joined(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    std::size_t at = hash_of(points[i]) >> shift;
    while (table[at] != none && points[table[at]] != points[i]) at = (at + 1) % places;
    if (table[at] == none) table[at] = i;
    joined[i] = table[at];
  }
  return joined;
}

Mesh clean_mesh(PolygonMesh polygons, double crease_degrees) {
  check(polygons);
  Mesh mesh;
  mesh.warnings = std::move(polygons.warnings);
  MeshCounts& counts = mesh.counts;
  counts.faces_read = polygons.face_sizes.size();
  counts.points_read = polygons.points.size();
  std::vector<std::uint32_t> joined = join_points(polygons.points);
  std::vector<glm::uvec3> given;  // of each triangle's corners, if there are normals
  mesh.triangles = make_triangles(polygons, joined, given, counts);
  counts.triangles = mesh.triangles.size();
  keep_used_points(polygons, joined, mesh);
  const std::vector<glm::vec3> normals = std::move(polygons.normals);
  polygons = {};  // at millions of triangles each copy counts
  joined = {};
  Topology topology = find_topology(mesh.triangles, mesh.positions.size());
  orient(topology, given, mesh);
  counts.boundary_edges = topology.boundary_edges;
  counts.non_manifold_edges = topology.non_manifold_edges;
  counts.parts = topology.closed.size();
  mesh.closed = counts.boundary_edges == 0 && counts.non_manifold_edges == 0;
  const std::vector<glm::dvec3> flat = flat_normals(mesh);
  compute_normals(topology, flat, crease_degrees, mesh);
  if (!given.empty()) use_given_normals(normals, given, topology, flat, mesh);
  add_warnings(topology, flat, mesh);
  return mesh;
}

}  // namespace parian
