// Edges by sorting, parts by union-find, orientation by signed volume and nesting by a ray's parity.
#include "mesh_topology.hpp"

#include <algorithm>
#include <numeric>

#include "union_find.hpp"

namespace parian {
namespace {

struct Halfedge {
  std::uint32_t other;  ///< the higher point of the edge
  std::uint32_t index;
};

/// One closed part, for the question of what lies within what.
struct Solid {
  std::uint32_t part;
  std::vector<std::uint32_t> triangles;
  glm::dvec3 low{std::numeric_limits<double>::max()};
  glm::dvec3 high{std::numeric_limits<double>::lowest()};
  double volume = 0.0;
  bool turned = false;
};

/// Whether the edge a-b, seen along x, passes p's upper side. Each edge answers the same from both its triangles, since
/// its points are put in order first; so a closed surface is crossed consistently, at edges and corners too.
bool edge_above(const std::vector<glm::dvec3>& positions, std::uint32_t a, std::uint32_t b, const glm::dvec3& p) {
  const glm::dvec3& low = positions[std::min(a, b)];
  const glm::dvec3& high = positions[std::max(a, b)];
  if ((low.y > p.y) == (high.y > p.y)) return false;
  return low.z + (p.y - low.y) / (high.y - low.y) * (high.z - low.z) > p.z;
}

/// Whether a ray from p towards +x crosses the surface an odd number of times.
bool is_inside(const std::vector<glm::dvec3>& positions, const std::vector<glm::uvec3>& triangles, const Solid& solid,
               const glm::dvec3& p) {
  bool inside = false;
  for (const std::uint32_t t : solid.triangles) {
    const glm::uvec3& c = triangles[t];
    const bool hit = edge_above(positions, c[0], c[1], p) ^ edge_above(positions, c[1], c[2], p) ^
                     edge_above(positions, c[2], c[0], p);
    if (!hit) continue;
    const glm::dvec3 a = positions[c[0]] - p;
    const glm::dvec3 n = glm::cross(positions[c[1]] - positions[c[0]], positions[c[2]] - positions[c[0]]);
    if (n.x != 0.0 && glm::dot(n, a) / n.x > 0.0) inside = !inside;
  }
  return inside;
}

std::vector<Solid> find_solids(const std::vector<glm::dvec3>& positions, const std::vector<glm::uvec3>& triangles,
                               const Topology& topology) {
  std::vector<std::uint32_t> slot(topology.closed.size(), no_mate);
  std::vector<Solid> solids;
  for (std::uint32_t part = 0; part < topology.closed.size(); ++part) {
    if (!topology.closed[part]) continue;
    slot[part] = static_cast<std::uint32_t>(solids.size());
    solids.emplace_back().part = part;
  }
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (slot[topology.parts[t]] == no_mate) continue;
    Solid& solid = solids[slot[topology.parts[t]]];
    solid.triangles.push_back(t);
    // Relative to a point of the part, so that parts far from the origin keep their digits.
    const glm::dvec3 origin = positions[triangles[solid.triangles.front()][0]];
    const glm::dvec3 a = positions[triangles[t][0]] - origin;
    const glm::dvec3 b = positions[triangles[t][1]] - origin;
    const glm::dvec3 c = positions[triangles[t][2]] - origin;
    solid.volume += glm::dot(a, glm::cross(b, c)) / 6.0;
    for (int k = 0; k < 3; ++k) {
      solid.low = glm::min(solid.low, positions[triangles[t][k]]);
      solid.high = glm::max(solid.high, positions[triangles[t][k]]);
    }
  }
  return solids;
}

/// The solids around `solid`, as indices.
std::vector<std::size_t> find_containers(const std::vector<glm::dvec3>& positions,
                                         const std::vector<glm::uvec3>& triangles, const std::vector<Solid>& solids,
                                         std::size_t solid) {
  const Solid& inner = solids[solid];
  const glm::dvec3 p = positions[triangles[inner.triangles.front()][0]];
  std::vector<std::size_t> containers;
  for (std::size_t i = 0; i < solids.size(); ++i) {
    const bool box_within = i != solid && glm::all(glm::lessThanEqual(solids[i].low, inner.low)) &&
                            glm::all(glm::greaterThanEqual(solids[i].high, inner.high));
    if (box_within && is_inside(positions, triangles, solids[i], p)) containers.push_back(i);
  }
  return containers;
}

double box_volume(const Solid& solid) {
  const glm::dvec3 size = solid.high - solid.low;
  return size.x * size.y * size.z;
}

}  // namespace

Topology find_topology(const std::vector<glm::uvec3>& triangles, std::size_t points) {
  Topology topology;
  const std::size_t halfedges = 3 * triangles.size();
  const auto corner = [&](std::uint32_t h) { return triangles[h / 3][static_cast<int>(h % 3)]; };
  const auto tip = [&](std::uint32_t h) { return triangles[h / 3][static_cast<int>((h % 3 + 1) % 3)]; };
  // Halfedges in buckets by the lower point of their edge; buckets are sorted by the higher.
  std::vector<std::uint32_t> bucket(points + 1, 0);
  for (std::uint32_t h = 0; h < halfedges; ++h) ++bucket[std::min(corner(h), tip(h)) + 1];
  std::partial_sum(bucket.begin(), bucket.end(), bucket.begin());
  std::vector<Halfedge> sorted(halfedges);
  std::vector<std::uint32_t> fill(bucket.begin(), bucket.end() - 1);
  for (std::uint32_t h = 0; h < halfedges; ++h)
    sorted[fill[std::min(corner(h), tip(h))]++] = {std::max(corner(h), tip(h)), h};
  topology.mates.assign(halfedges, no_mate);
  UnionFind connected(triangles.size());
  for (std::size_t point = 0; point < points; ++point) {
    const auto end = sorted.begin() + bucket[point + 1];
    std::sort(sorted.begin() + bucket[point], end, [](const Halfedge& a, const Halfedge& b) {
      return a.other != b.other ? a.other < b.other : a.index < b.index;
    });
    for (auto first = sorted.begin() + bucket[point]; first != end;) {
      const auto last = std::find_if(first, end, [&](const Halfedge& h) { return h.other != first->other; });
      for (auto h = first + 1; h < last; ++h) connected.join(first->index / 3, h->index / 3);
      if (last - first == 1) {
        ++topology.boundary_edges;
      } else if (last - first == 2 && corner(first->index) != corner(first[1].index)) {
        topology.mates[first->index] = first[1].index;
        topology.mates[first[1].index] = first->index;
      } else {
        ++topology.non_manifold_edges;
      }
      first = last;
    }
  }
  topology.parts.resize(triangles.size());
  std::vector<std::uint32_t> number(triangles.size(), no_mate);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    std::uint32_t& part = number[connected.find(t)];
    if (part == no_mate) {
      part = static_cast<std::uint32_t>(topology.closed.size());
      topology.closed.push_back(true);
    }
    topology.parts[t] = part;
    for (int k = 0; k < 3; ++k)
      if (topology.mates[3 * t + k] == no_mate) topology.closed[part] = false;
  }
  return topology;
}

std::size_t orient_closed_parts(const std::vector<glm::dvec3>& positions, std::vector<glm::uvec3>& triangles,
                                Topology& topology) {
  std::vector<Solid> solids = find_solids(positions, triangles, topology);
  std::vector<std::size_t> order(solids.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  // A container has the larger box, so that it is decided on before what it contains.
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return box_volume(solids[a]) > box_volume(solids[b]); });
  std::size_t turned = 0;
  for (const std::size_t i : order) {
    Solid& solid = solids[i];
    if (solid.volume >= 0.0 && turned == 0) continue;
    const std::vector<std::size_t> around = find_containers(positions, triangles, solids, i);
    if (around.size() % 2 == 0) {
      solid.turned = solid.volume < 0.0;
    } else {
      const std::size_t parent = *std::min_element(around.begin(), around.end(), [&](std::size_t a, std::size_t b) {
        return box_volume(solids[a]) < box_volume(solids[b]);
      });
      solid.turned = solid.volume > 0.0 && solids[parent].turned;
    }
    if (!solid.turned) continue;
    ++turned;
    for (const std::uint32_t t : solid.triangles) std::swap(triangles[t][1], triangles[t][2]);
  }
  if (turned > 0) topology = find_topology(triangles, positions.size());
  return turned;
}

}  // namespace parian
