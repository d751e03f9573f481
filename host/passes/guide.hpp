// Guides of samples: which lit places give light to tiles of texels that lie away from them.
#pragma once
#include <CL/cl.h>

namespace parian {

struct Passes;

/// Where the tiles that want guides lie.
void find_stands(Passes& p);
/// The guides anew, for light maps that have been drawn anew.
void make_guides(Passes& p);
/// Where the guides of a light begin, after all maps' lists.
[[nodiscard]] cl_uint first_guide(const Passes& p, cl_uint l);

}  // namespace parian
