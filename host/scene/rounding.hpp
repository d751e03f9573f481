// Coordinates in single precision far from the origin, whose rounding is a staircase on what they describe.
#pragma once
#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace parian {

/// A warning if `points`, whose box goes from `low` to `high`, look like floats that were rounded to more than a ten
/// thousandth of that box; empty if not. Points on a coarser grid than floats have, such as whole numbers, aren't taken
/// for rounded, nor are ones that hold more digits than floats.
[[nodiscard]] std::string rounding_warning(const std::vector<glm::dvec3>& points, const glm::dvec3& low,
                                           const glm::dvec3& high);

}  // namespace parian
