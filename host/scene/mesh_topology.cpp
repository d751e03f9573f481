// Edges by sorting, parts by union-find, orientation by signed volume and nesting by a ray's parity.
#include "scene/mesh_topology.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "scene/box.hpp"
#include "scene/union_find.hpp"

namespace parian {
namespace {

struct Halfedge {
  std::uint32_t other;  ///< the higher point of the edge
  std::uint32_t index;
};

/// Calls `use(h, from, to)` for each halfedge and the points that it leads from and to.
void for_halfedges(const std::vector<glm::uvec3>& triangles, const auto& use) {
  std::uint32_t h = 0;
  for (const glm::uvec3& t : triangles) {
    use(h++, t.x, t.y);
    use(h++, t.y, t.z);
    use(h++, t.z, t.x);
  }
}

/// One closed part, for the question of what lies within what.
struct Solid {
  std::uint32_t part;
  std::vector<std::uint32_t> triangles;
  Box<> box;
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
    const glm::dvec3& origin = positions[triangles[solid.triangles.front()].x];
    const glm::dvec3 &a = positions[triangles[t].x], &b = positions[triangles[t].y], &c = positions[triangles[t].z];
    solid.volume += glm::dot(a - origin, glm::cross(b - origin, c - origin)) / 6.0;
    for (const glm::dvec3& corner : {a, b, c}) solid.box.add(corner);
  }
  return solids;
}

bool box_within(const Solid& inner, const Solid& outer) {
  return glm::all(glm::lessThanEqual(outer.box.low, inner.box.low)) &&
         glm::all(glm::greaterThanEqual(outer.box.high, inner.box.high));
}

/// The solids around `solid`, as indices.
std::vector<std::size_t> find_containers(const std::vector<glm::dvec3>& positions,
                                         const std::vector<glm::uvec3>& triangles, const std::vector<Solid>& solids,
                                         std::size_t solid) {
  const Solid& inner = solids[solid];
  const glm::dvec3 p = positions[triangles[inner.triangles.front()][0]];
  std::vector<std::size_t> containers;
  for (std::size_t i = 0; i < solids.size(); ++i) {
    if (i != solid && box_within(inner, solids[i]) && is_inside(positions, triangles, solids[i], p))
      containers.push_back(i);
  }
  return containers;
}

double box_volume(const Solid& solid) {
  const glm::dvec3 size = solid.box.size();
  return size.x * size.y * size.z;
}

/// Order in which whatever holds another comes before it.
std::vector<std::size_t> by_box_volume(const std::vector<Solid>& solids) {
  std::vector<std::size_t> order(solids.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return box_volume(solids[a]) > box_volume(solids[b]); });
  return order;
}

/// A solid's points that lie farthest in each direction of the axes: where all are within another, so is all of it but
/// for what pokes out sideways.
std::array<glm::dvec3, 6> extremes(const std::vector<glm::dvec3>& positions, const std::vector<glm::uvec3>& triangles,
                                   const Solid& solid) {
  std::array<glm::dvec3, 6> points;
  points.fill(positions[triangles[solid.triangles.front()][0]]);
  for (const std::uint32_t t : solid.triangles)
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3& p = positions[triangles[t][k]];
      for (int axis = 0; axis < 3; ++axis) {
        if (p[axis] < points[2 * axis][axis]) points[2 * axis] = p;
        if (p[axis] > points[2 * axis + 1][axis]) points[2 * axis + 1] = p;
      }
    }
  return points;
}

std::string size_of(const Solid& solid) {
  const glm::dvec3 size = solid.box.size();
  return fmt::format("{:.4g} x {:.4g} x {:.4g}", size.x, size.y, size.z);
}

}  // namespace

Topology find_topology(const std::vector<glm::uvec3>& triangles, std::size_t points) {
  Topology topology;
  const std::size_t halfedges = 3 * triangles.size();
  const std::uint32_t* corner = triangles.empty() ? nullptr : &triangles.front().x;  // where each halfedge begins
  // Halfedges in buckets by the lower point of their edge; buckets are sorted by the higher.
  std::vector<std::uint32_t> bucket(points + 1, 0);
  for_halfedges(triangles,
                [&](std::uint32_t, std::uint32_t from, std::uint32_t to) { ++bucket[std::min(from, to) + 1]; });
  std::partial_sum(bucket.begin(), bucket.end(), bucket.begin());
  std::vector<Halfedge> sorted(halfedges);
  std::vector<std::uint32_t> fill(bucket.begin(), bucket.end() - 1);
  for_halfedges(triangles, [&](std::uint32_t h, std::uint32_t from, std::uint32_t to) {
    sorted[fill[std::min(from, to)]++] = {std::max(from, to), h};
  });
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
      } else if (last - first == 2 && corner[first->index] != corner[first[1].index]) {
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
  std::size_t turned = 0;
  for (const std::size_t i : by_box_volume(solids)) {
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

std::string nesting_warning(const std::vector<glm::dvec3>& positions, const std::vector<glm::uvec3>& triangles,
                            const Topology& topology) {
  if (std::count(topology.closed.begin(), topology.closed.end(), true) < 2) return {};
  const std::vector<Solid> solids = find_solids(positions, triangles, topology);
  const std::vector<std::size_t> order = by_box_volume(solids);
  std::size_t work = 16 * triangles.size() + 100000;  // triangles and boxes that may be looked at
  const auto spend = [&](std::size_t amount) {
    const bool enough = work >= amount;
    work = enough ? work - amount : 0;
    return enough;
  };
  std::size_t count = 0;
  const Solid *inner = nullptr, *outer = nullptr;
  for (std::size_t i = 1; i < order.size() && work > 0; ++i)
    for (std::size_t j = i; j-- > 0 && spend(1);) {  // the smallest that may hold it first
      const Solid &a = solids[order[i]], &b = solids[order[j]];
      if (!box_within(a, b) || !spend(6 * b.triangles.size() + a.triangles.size())) continue;
      const auto points = extremes(positions, triangles, a);
      if (!std::all_of(points.begin(), points.end(),
                       [&](const glm::dvec3& p) { return is_inside(positions, triangles, b, p); }))
        continue;
      if (count++ == 0) {
        inner = &a;
        outer = &b;
      }
      break;
    }
  if (count == 0) return {};
  return fmt::format(
      "{} inside another, {} of {} mm in one of {} mm: light goes on through cavities and gaps as if they "
      "were filled, so walls thinner than two effective mean free paths (2/sigma_tr) look as if solid; "
      "leave out what you don't mean",
      count == 1 ? "a closed part lies" : fmt::format("{} closed parts lie", count), count == 1 ? "one" : "the largest",
      size_of(*inner), size_of(*outer));
}

}  // namespace parian
