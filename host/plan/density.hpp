// The radial density of samples around a point's nearest lit place, tabulated in double.
#pragma once
#include <array>
#include <vector>

#include "kernels/types.h"
#include "scene/scene.hpp"

namespace parian {

struct DensityTable {
  kernels::Density parameters{};
  std::vector<std::array<float, 2>> rho;  ///< over equal steps of log G, largest first; and its fall to the next
};

/// `media` in object units, at least one. G(t) = integral from t to infinity of s^(1-p) exp(-sigma_tr s) ds with
/// p = 2.1 and the smallest sigma_tr of the media, D of the middle one; `disc_radius` in object units, 0 for the
/// default of eight effective mean free paths, at most the object.
[[nodiscard]] DensityTable density_table(const std::vector<kernels::Medium>& media, double disc_radius);

}  // namespace parian
