// Pass 3: bilateral mip chains of the layers.
#pragma once
#include <cstdint>

namespace parian {

struct Passes;

/// Levels 1 to `level`.
void build_pyramids(Passes& p, std::uint32_t level);

}  // namespace parian
