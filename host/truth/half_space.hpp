// How much light a half-space sends back: by a random walk, which is the truth, and by a dipole model.
#pragma once
#include <cstdint>

#include "scene/medium.hpp"

namespace parian {

/// A homogeneous medium below a smooth plane. Only the ratio of the coefficients matters, so their unit doesn't.
struct HalfSpace {
  double sigma_s = 1, sigma_a = 0;
  double g = 0;    ///< of Henyey and Greenstein's phase function; 0 scatters evenly
  double eta = 1;  ///< index inside / outside
};

/// Where light goes that arrives from one direction. `entered` is a share of the flux that arrived, the others are
/// shares of the flux that entered; those three add up to 1.
struct RandomWalk {
  double entered = 0;         ///< T12, the rest is mirrored
  double escaped = 0;         ///< left through the surface, whatever the direction
  double standard_error = 0;  ///< of `escaped`
  double absorbed = 0;
  double inside = 0;  ///< on its way still after a million collisions; 0 but for media that hardly absorb

  /// The albedo, a share of the flux that arrived, without what the surface mirrors; and its standard error.
  [[nodiscard]] double albedo() const { return entered * escaped; }
  [[nodiscard]] double albedo_error() const { return entered * standard_error; }
};

/// Follows `photons` from light at `cos_outside` to the normal, by the radiative transfer equation with unpolarised
/// Fresnel reflection at the surface and no further approximation. The result depends on `seed` and not on `threads`
/// (0: all processors). Throws Error(input) when a parameter is out of range.
[[nodiscard]] RandomWalk random_walk(const HalfSpace& medium, double cos_outside, std::uint64_t photons,
                                     std::uint64_t seed, unsigned threads = 0);

/// The same albedo as Parian's pictures have it: T12 times the integral of S_d over the plane and of T21 cos over the
/// directions of exit, which is T12 4 pi C_phi(1/eta) int S_d dA. By quadrature with bssrdf.h in double, to 1e-9 of
/// itself, or 1e-5 where S_d is cut off at 0 in part of the plane (oblique light at eta near 1 or at small albedos).
[[nodiscard]] double dipole_albedo(const ChannelConstants& channel, Model model, double cos_outside);

}  // namespace parian
