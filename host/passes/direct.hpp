// Pass 2's own function at pixels' points: where no layer sees them, and where layers are judged.
#pragma once
#include <CL/cl.h>

#include <cstdint>
#include <vector>

#include "core/stage.hpp"
#include "kernels/types.h"

namespace parian {

struct Passes;

/// Adds `rounds` rounds of samples from round `round` on, times `sign`, to `sets` of the film, at one of a window's
/// subpixel positions of the pixels in one of the film's lists.
void add_direct(Passes& p, const kernels::View& view, const kernels::Window& window, cl_uint position, cl_uint list,
                std::uint32_t round, std::uint32_t rounds, float sign, cl_uint sets, Stage stage);
/// Subtracts from the film what pass 2's function gives at the points of some pixels themselves, at the subpixel
/// positions that `gather` has just added.
void subtract_direct(Passes& p, const kernels::View& view, const kernels::Window& window,
                     const std::vector<cl_uint>& chosen, std::uint32_t round, std::uint32_t rounds, Stage stage);

}  // namespace parian
