// Sums in double, so that a million pixels lose nothing.
#include "estimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace parian {

double estimated_relmse(const Halves& h) {
  double mean = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < h.alpha.size(); ++i) {
    if (h.alpha[i] < 0.999F) continue;
    for (int c = 0; c < 3; ++c) mean += 0.5 * (double{h.a[i][c]} + double{h.b[i][c]});
    count += 3;
  }
  if (count == 0)  // an empty film is exact; edges alone tell nothing
    return std::any_of(h.alpha.begin(), h.alpha.end(), [](float alpha) { return alpha > 0.0F; }) ? -1.0 : 0.0;
  if (!std::isfinite(mean)) return std::numeric_limits<double>::infinity();  // a NaN must never count as converged
  if (mean <= 0.0) return 0.0;
  const double epsilon = 0.01 * mean / static_cast<double>(count);
  double variance = 0.0, blur = 0.0;
  for (std::size_t i = 0; i < h.alpha.size(); ++i) {
    if (h.alpha[i] < 0.999F) continue;
    for (int c = 0; c < 3; ++c) {
      const double a = h.a[i][c], b = h.b[i][c], shown = 0.5 * (a + b);
      const double weight = 1.0 / (shown * shown + epsilon * epsilon);
      variance += weight * 0.25 * (a - b) * (a - b);
      blur += weight * (a - double{h.a0[i][c]}) * (b - double{h.b0[i][c]});
    }
  }
  if (!std::isfinite(variance + blur)) return std::numeric_limits<double>::infinity();
  // Noise may drive the estimate of the squared blur below 0, where no square is.
  return (variance + std::max(blur, 0.0)) / static_cast<double>(count);
}

}  // namespace parian
