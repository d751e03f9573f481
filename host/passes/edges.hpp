// Pixels on one smooth surface need few subpixel positions: what is still to be drawn are those with edges near by.
#pragma once
#include <cstddef>
#include <cstdint>

#include "kernels/types.h"

namespace parian {

struct Passes;

/// Which pixels of a window that draw_film has drawn have edges, going by its subpixel positions; `gather` adds those
/// that no layer sees.
void find_edges(Passes& p, const kernels::View& view, const kernels::Window& window);
/// After `done` of `positions` subpixel positions: pixels without an edge near by count as gathered at all positions,
/// and the others are written to the film's `open`.
void settle_film(Passes& p, const kernels::Window& window, std::size_t levels, std::uint32_t done,
                 std::uint32_t positions);
/// From now on draws nothing of this window but the pixels that are `open`, until free_film.
void restrict_film(Passes& p, const kernels::View& view, kernels::Window& window);
void free_film(Passes& p, kernels::Window& window);

}  // namespace parian
