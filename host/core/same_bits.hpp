// Whether two of the structs that cross to a device would be the same to it.
#pragma once
#include <array>
#include <bit>
#include <cstdint>

namespace parian {

/// By their bits: -0 differs from 0, and a NaN equals itself. T must have no holes.
template <typename T>
[[nodiscard]] bool same_bits(const T& a, const T& b) {
  using Words = std::array<std::uint32_t, sizeof(T) / sizeof(std::uint32_t)>;
  return std::bit_cast<Words>(a) == std::bit_cast<Words>(b);
}

}  // namespace parian
