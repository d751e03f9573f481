// What lies next to what in a list of triangles. No half-edge mesh: edges where surfaces cross or meet lose no face.
#pragma once
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <string>
#include <vector>

namespace parian {

inline constexpr std::uint32_t no_mate = std::numeric_limits<std::uint32_t>::max();

/// Edges and connected parts. Halfedge 3t+k leads from corner k of triangle t to corner k+1.
struct Topology {
  std::vector<std::uint32_t>
      mates;  ///< per halfedge: the one opposite, if exactly these two share the edge; or no_mate
  std::vector<std::uint32_t> parts;  ///< per triangle: its connected part; triangles that share an edge are connected
  std::vector<bool> closed;          ///< per part: each of its edges has exactly two triangles of opposite direction
  std::size_t boundary_edges = 0;
  std::size_t non_manifold_edges = 0;
};

/// Finds edges by sorting, and parts. O(n log n).
[[nodiscard]] Topology find_topology(const std::vector<glm::uvec3>& triangles, std::size_t points);

/// Turns closed parts round that face the wrong way: the outermost must face outward; within them lie cavities, which
/// may face inward, so that they are left alone unless the part around them was turned and they face alike.
/// Updates `topology`; returns the number of parts turned.
std::size_t orient_closed_parts(const std::vector<glm::dvec3>& positions, std::vector<glm::uvec3>& triangles,
                                Topology& topology);

/// A warning with the sizes of both if a closed part lies within another: dipoles know surfaces, not paths, so that
/// light passes cavities and gaps as if they were filled. Empty if none does. Looks no longer than a pass over the mesh
/// takes, and may then count too few.
[[nodiscard]] std::string nesting_warning(const std::vector<glm::dvec3>& positions,
                                          const std::vector<glm::uvec3>& triangles, const Topology& topology);

}  // namespace parian
