// Sorts, and takes the ends and the middle.
#include "truth/spread.hpp"

#include <algorithm>
#include <cstddef>

namespace parian {

Spread spread(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return {values.front(), 0.5 * (values[(n - 1) / 2] + values[n / 2]), values.back()};
}

}  // namespace parian
