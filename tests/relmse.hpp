// relMSE in tests, of pictures of the library and of the API alike.
#pragma once
#include <cstddef>
#include <vector>

#include "core/relative_error.hpp"

namespace parian::test {

/// relMSE as the contract defines it, of RGBA; NaN where no pixel is covered fully in both.
inline double relmse(const std::vector<float>& image, const std::vector<float>& reference) {
  std::vector<std::size_t> inside;  // values
  double total = 0.0, sum = 0.0;
  for (std::size_t i = 0; i < reference.size(); ++i)
    if (i % 4 < 3 && image[i | 3] >= fully_covered && reference[i | 3] >= fully_covered) {
      inside.push_back(i);
      total += reference[i];
    }
  const auto count = static_cast<double>(inside.size());
  const RelativeTo relative(total, count);
  for (const std::size_t i : inside) {
    const double r = reference[i], d = image[i] - r;
    sum += d * d / relative(r);
  }
  return sum / count;
}

}  // namespace parian::test
