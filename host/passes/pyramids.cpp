// Pass 3: coarser levels of the layers.
#include "passes/pyramids.hpp"

#include "passes/passes.hpp"

namespace parian {

void build_pyramids(Passes& p, std::uint32_t level) {
  const Layers& k = p.layers;
  for (cl_uint l = 1; l <= level && l < k.levels; ++l)
    p.compute.launch("pyramids_level", k.level_first[l + 1] - k.level_first[l], Stage::pyramids, k.views_buffer,
                     k.count(), l, k.level_first_buffer, k.n_points, k.geometry, k.slots, k.values);
}

}  // namespace parian
