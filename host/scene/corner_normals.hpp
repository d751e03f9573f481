// Normals of a clean mesh's corners: computed ones, given ones where they are of use, and what light makes of both.
#pragma once
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "scene/mesh.hpp"
#include "scene/mesh_topology.hpp"

namespace parian {

/// The unit normal of each triangle.
[[nodiscard]] std::vector<glm::dvec3> flat_normals(const Mesh& mesh);

/// Angle-weighted normals. A corner's fan is what can be reached from its triangle across edges below the crease angle;
/// edges at the boundary or with more than two triangles, or two that disagree, always end it.
void compute_normals(const Topology& topology, const std::vector<glm::dvec3>& flat, double crease_degrees, Mesh& mesh);

/// Puts given normals in the place of computed ones; `ids` has each corner's among `given`, or no_normal. Where a
/// part's point into it, all of them are turned. Corners without one, or with one that isn't finite or faces away, keep
/// what was computed, with a warning.
void use_given_normals(const std::vector<glm::vec3>& given, const std::vector<glm::uvec3>& ids,
                       const Topology& topology, const std::vector<glm::dvec3>& flat, Mesh& mesh);

/// A warning if facets will show: light arrives by flat triangles, which corner normals can't smooth. Empty where
/// little of the surface is of triangles that are large and, though smoothed, at an angle to each other.
[[nodiscard]] std::string facets_warning(const Topology& topology, const std::vector<glm::dvec3>& flat,
                                         const Mesh& mesh);

}  // namespace parian
