// Parts of a mesh that are thinner in the picture than the places at which it is looked at.
#pragma once
#include <string>

#include "scene/scene.hpp"

namespace parian {

/// A line if connected parts that a camera shows longer than a pixel are thinner than an eighth of one, about what the
/// 64 subpixel positions of a picture are apart: some of the part may be missing there, or all. A part's width is that
/// of a bar, or where the mesh is open of a ribbon, of its length (its box's diagonal) and area. Empty otherwise.
[[nodiscard]] std::string thin_parts_warning(const Scene& scene);

}  // namespace parian
