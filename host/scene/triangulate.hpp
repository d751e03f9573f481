// One polygon into triangles.
#pragma once
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace parian {

/// Appends the triangles of one polygon, as indices into `corners` and in its direction, to `triangles`. The polygon
/// may be concave, slightly bent or have corners on straight edges; quads get the diagonal whose smaller triangle is
/// larger (the shorter one if equal), others lose ears in the plane of their mean normal. Always n - 2 triangles.
void triangulate(std::span<const glm::dvec3> corners, std::vector<glm::uvec3>& triangles);

}  // namespace parian
