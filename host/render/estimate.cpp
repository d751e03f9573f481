// Sums in double, so that a million pixels lose nothing.
#include "render/estimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/relative_error.hpp"

namespace parian {

namespace {

/// The mean of C over M and RGB, and how many values that is of.
struct Mean {
  double value = 0.0;
  std::size_t count = 0;
};

Mean mean_of(const Halves& h) {
  Mean mean;
  for (std::size_t i = 0; i < h.alpha.size(); ++i) {
    if (h.alpha[i] < fully_covered) continue;
    for (int c = 0; c < 3; ++c) mean.value += 0.5 * (double{h.a[i][c]} + double{h.b[i][c]});
    mean.count += 3;
  }
  if (mean.count > 0) mean.value /= static_cast<double>(mean.count);
  return mean;
}

/// 1 / (C^2 + eps^2) of one value.
double weight_of(double a, double b, const RelativeTo& relative) { return 1.0 / relative(0.5 * (a + b)); }

}  // namespace

double estimated_relmse(const Halves& h, const Halves& finest, const Expected& expected) {
  const Mean mean = mean_of(h);
  if (mean.count == 0) {  // an empty film is exact; edges alone tell nothing
    const bool edges = std::any_of(h.alpha.begin(), h.alpha.end(), [](float alpha) { return alpha > 0.0F; });
    return edges || expected.object ? -1.0 : 0.0;
  }
  if (!std::isfinite(mean.value))
    return std::numeric_limits<double>::infinity();  // a NaN must never count as converged
  if (mean.value <= 0.0) return expected.light ? -1.0 : 0.0;
  const RelativeTo relative(mean.value);
  double variance = 0.0, blur = 0.0;
  for (std::size_t i = 0; i < h.alpha.size(); ++i) {
    if (h.alpha[i] < fully_covered) continue;
    for (int c = 0; c < 3; ++c) {
      const double a = h.a[i][c], b = h.b[i][c], weight = weight_of(a, b, relative);
      variance += weight * 0.25 * (a - b) * (a - b);
      blur += weight * (a - double{finest.a[i][c]}) * (b - double{finest.b[i][c]});
    }
  }
  if (!std::isfinite(variance + blur)) return std::numeric_limits<double>::infinity();
  // Noise may drive the estimate of the squared blur below 0, where no square is.
  return (variance + std::max(blur, 0.0)) / static_cast<double>(mean.count);
}

double estimated_bias_relmse(const Halves& h, const PixelDifferences& d, const Expected& expected) {
  if (d.pixels.empty()) return -1.0;
  const Mean mean = mean_of(h);
  if (!std::isfinite(mean.value)) return std::numeric_limits<double>::infinity();
  if (mean.value <= 0.0) return expected.light ? -1.0 : 0.0;
  const RelativeTo relative(mean.value);
  double sum = 0.0;
  for (std::size_t i = 0; i < d.pixels.size(); ++i)
    for (int c = 0; c < 3; ++c)
      sum += weight_of(h.a[d.pixels[i]][c], h.b[d.pixels[i]][c], relative) * double{d.a[i][c]} * d.b[i][c];
  if (!std::isfinite(sum)) return std::numeric_limits<double>::infinity();
  return std::max(sum, 0.0) / (3.0 * static_cast<double>(d.pixels.size()));
}

}  // namespace parian
