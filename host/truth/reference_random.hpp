// Random numbers of the reference: one short stream per batch and pixel, so that no thread depends on another.
#pragma once
#include <cstdint>

namespace parian {

/// SplitMix64 (Steele, Lea, Flood 2014): a counter, mixed.
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, std::uint64_t batch, std::uint64_t pixel)
      : state_(mix(mix(mix(seed) ^ batch) + pixel)) {}
  /// Uniform in [0, 1).
  double operator()() { return static_cast<double>(mix(state_ += step) >> 11) * 0x1p-53; }

 private:
  static constexpr std::uint64_t step = 0x9e3779b97f4a7c15;
  static std::uint64_t mix(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
    x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
    return x ^ (x >> 31);
  }
  std::uint64_t state_;
};

}  // namespace parian
