// The second half of the plan, from what is seen: which directions the layers take, and which of their texels are read.
#pragma once
#include <vector>

#include "passes/passes.hpp"

namespace parian {

/// Points spread over the surface, (x, 0) and (n_g, 0) each, and whether any of many directions sees them.
struct SurfaceSight {
  std::vector<kernels::float4> points;
  std::vector<bool> outside;
};

/// Places `count` layers of `size` texels a side greedily, by the surface that each adds to what the others see; never
/// covering less than evenly spread directions do. Fewer where no more add anything, unless all are asked for with
/// `complete`. `positions` in object units. Fills `sight`.
[[nodiscard]] std::vector<kernels::View> place_layers(Passes& p, const std::vector<glm::dvec3>& positions,
                                                      const std::vector<glm::uvec3>& triangles, std::uint32_t count,
                                                      std::uint32_t size, SurfaceSight& sight, bool complete = false);

/// Share of the surface visible from outside that at least one layer sees.
[[nodiscard]] double layer_coverage(Passes& p, const SurfaceSight& sight);

/// Marks the texels of all layers that a view reads, in `marks` (one uint per level-0 texel).
void mark_needed(Passes& p, const kernels::View& view, const kernels::Window& window, const cl::Buffer& marks);

/// Level-0 texels that `cameras` read at `film` pixels, in rising order; or all that hold a surface. Looked for at 8
/// of an image's subpixel positions where texels are larger than pixels, at up to all 64 where they are smaller; a
/// texel missed between them counts as empty, and its neighbours stand in.
[[nodiscard]] std::vector<cl_uint> read_texels(Passes& p, const std::vector<kernels::View>& cameras, glm::uvec2 film);
[[nodiscard]] std::vector<cl_uint> covered_texels(Passes& p);

/// Layer texels along a pixel's side, at the distance of the object's centre.
[[nodiscard]] double texels_per_pixel(const Layers& layers, const kernels::View& camera);

/// Windows of at most `side` pixels a side that cut a film into pieces.
[[nodiscard]] std::vector<kernels::Window> tiles(glm::uvec2 film, std::uint32_t side);

}  // namespace parian
