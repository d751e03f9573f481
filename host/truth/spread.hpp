// What several values of one thing are told as.
#pragma once
#include <vector>

namespace parian {

/// Smallest, median and largest.
struct Spread {
  double low = 0, median = 0, high = 0;
};
/// Of at least one value; the median of an even number is the mean of the middle two.
[[nodiscard]] Spread spread(std::vector<double> values);

}  // namespace parian
