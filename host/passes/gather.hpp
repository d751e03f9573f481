// Pass 4: the camera's view, gathered from the layers.
#pragma once
#include <CL/opencl.hpp>

#include <cstdint>
#include <optional>
#include <vector>

#include "core/stage.hpp"
#include "kernels/types.h"

namespace parian {

struct Passes;

/// The camera's film: halves A and B for up to three pyramid levels, lists of pixels that no layer sees, one for each
/// subpixel position, how many these are now and were in all, and the points of some of them with their values.
struct Film {
  cl::Buffer depth, ids, sums, direct, n_direct;
  cl::Buffer n_held, points, centres, values;
  cl::Buffer edges, open;              ///< of each pixel: whether it is an edge, and what to draw
  std::optional<kernels::View> drawn;  ///< of which ids hold `window`
  kernels::Window window{};
  std::uint32_t side = 0;  ///< of windows, at most, in pixels
};

/// The layers that a view reads: all of them, or its own alone.
struct LayerRange {
  cl_uint first = 0, count = 0;
};

/// Draws a window of a view into the film's ids, unless they hold it already; returns whether it had to.
bool draw_film(Passes& p, const kernels::View& view, const kernels::Window& window, bool again, Stage stage);
/// Adds the subpixel positions of a window of a view, which draw_film has drawn, to the film, for the given levels of
/// the layers. `scale` is 1 / frames; pixels that no layer sees take `rounds` rounds of samples at each position, from
/// round `round` on.
void gather(Passes& p, const kernels::View& view, const kernels::Window& window, const LayerRange& layers,
            const std::vector<cl_uint>& levels, float scale, std::uint32_t round, std::uint32_t rounds, Stage stage);

}  // namespace parian
