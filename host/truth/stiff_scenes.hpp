// Whole small scenes with stiff parameters, rendered as users render, against closed forms and the reference.
#pragma once
#include <functional>
#include <vector>

#include "truth/trial.hpp"

namespace parian {

struct StiffScene {
  const char* name;     ///< what is stiff
  const char* outcome;  ///< what is documented to happen
  std::function<Finding(Trial&)> run;
};

[[nodiscard]] const std::vector<StiffScene>& stiff_scenes();

/// Scattered radiance of an infinite plane in units of the irradiance on a surface that faces the light: T12 cos(theta)
/// times the integral of S_d over the plane, in double, for light at `cosine` to the normal. Without T21.
[[nodiscard]] double plane_radiance(const ChannelConstants& channel, Model model, double cosine);

}  // namespace parian
