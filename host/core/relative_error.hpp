// What relative errors are relative to, and the pixels that they are means over: one definition for the estimates of
// pictures in the making and for what compares finished ones.
#pragma once

namespace parian {

/// Alpha from which a pixel counts as the object's alone. Those pixels are called M.
inline constexpr float fully_covered = 0.999F;

/// R^2 + eps^2, which the squared error of a value R is divided by. eps is a hundredth of the mean of R over M and RGB,
/// so that black divides nothing.
class RelativeTo {
 public:
  /// From the sum of R over M and RGB and the number of values in it, or from their mean.
  explicit RelativeTo(double sum, double values = 1.0) {
    const double epsilon = 0.01 * sum / values;
    epsilon_squared_ = epsilon * epsilon;
  }
  [[nodiscard]] double operator()(double r) const { return r * r + epsilon_squared_; }

 private:
  double epsilon_squared_;
};

}  // namespace parian
