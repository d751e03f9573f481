// Triangles to visibility, and where a film's samples lie; every pass that sees the surface uses it.
#pragma once
#include <CL/cl.h>

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>

#include "core/stage.hpp"
#include "kernels/types.h"

namespace cl {
class Buffer;
}

namespace parian {

struct Passes;

/// Set-up of one view, unless it's the last one; `draw` then fills depth, and ids if given, for a window of it.
void setup_view(Passes& p, const kernels::View& view, Stage stage);
/// A restricted window is the film's: see restrict_film.
void draw(Passes& p, const kernels::Window& window, const cl::Buffer& depth, const cl::Buffer* ids, Stage stage);

/// All of a view, with a sample at a place in each pixel, in 1/256.
[[nodiscard]] kernels::Window whole(const kernels::View& view, glm::ivec2 sample = {128, 128});
[[nodiscard]] inline std::size_t pixels(const kernels::Window& w) { return std::size_t{w.width} * w.height; }

/// Work-items of a kernel that takes samples side by side, of one pixel or as many as the plan has lanes.
[[nodiscard]] std::size_t in_lanes(const Passes& p, std::size_t samples, std::uint32_t log_positions = 0);
[[nodiscard]] std::size_t in_lanes(const Passes& p, const kernels::Window& window);
/// Launches that take a window's subpixel positions: with one lane, one for each.
[[nodiscard]] cl_uint launches(const Passes& p, const kernels::Window& window);

/// The sub-texel or subpixel position with index `i` of a sequence started at `start`, in 1/256: points of R2, each
/// followed by its mirror image, since positions that aren't centred shift the image: 64 of R2 alone by 0.02 pixels,
/// which is 1 % of the light at a silhouette.
[[nodiscard]] glm::ivec2 subpixel_position(std::uint32_t i, std::uint32_t start);
/// Has a window drawn at the film's subpixel positions from `first` on, as many side by side as can be but no more than
/// `left`; returns how many.
std::uint32_t set_positions(kernels::Window& w, std::uint32_t first, std::uint32_t left);

}  // namespace parian
