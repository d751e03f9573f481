// The constants of a material that S_d needs, computed in double: one struct per colour channel.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "kernels/bssrdf.h"
#include "kernels/types.h"
#include "scene/scene.hpp"

namespace parian {

/// Fresnel moments of the inside-to-outside reflectance at relative index `eta` (physics: internal side looks out at
/// 1/eta). C_phi = (1 - 2 C_1)/4, C_E = (1 - 3 C_2)/2, by 20-node Gauss quadrature in panels that shrink towards the
/// critical angle.
struct FresnelMoments {
  double C_phi = 0.25, C_E = 0.5;
};
[[nodiscard]] FresnelMoments fresnel_moments(double eta);

/// Derived quantities of one channel, lengths in transport mean free paths (1/sigma_t') unless said otherwise.
struct ChannelConstants {
  double sigma_t_prime = 0;                  ///< reduced extinction, in the unit of the coefficients given
  double alpha_prime = 0;                    ///< reduced albedo
  double absorbed = 1;                       ///< 1 - alpha', as sigma_a / sigma_t'
  double sigma_tr = 0;                       ///< sqrt(3 (1 - alpha'))
  double d_e = 0;                            ///< extrapolation length 2.131 D / sqrt(alpha') (FHK 21)
  double z_v = 0;                            ///< virtual source height 2 A d_e
  double a_back = 0;                         ///< squared backlit offset (sigma_t' / (3 sigma_t))^2 (FHK 25)
  double C_phi = 0, C_E = 0, C_phi_inv = 0;  ///< moments at eta, eta, and C_phi at 1/eta
  double A = 0;                              ///< boundary mismatch (1 - C_E) / (2 C_phi)
  double eta = 1;
};
/// Finite for every input of valid range, where a formula has a limit that is the limit; alpha' below 1e-6 counts as
/// 1e-6 in d_e and z_v.
[[nodiscard]] ChannelConstants channel_constants(double sigma_s, double sigma_a, double g, double eta);

/// Reduced albedo below which light is absorbed before it is scattered enough to diffuse, and every dipole is poor.
inline constexpr double least_diffusive_albedo = 0.5;

/// All that S_d needs of a material, in double: derived once, and handed on.
struct Optics {
  std::array<ChannelConstants, 3> channels{};
  kernels::ExactBoundary boundary{};
};
[[nodiscard]] Optics optics_of(const Material& material);

/// What is likely a mistake, or beyond the model: a line for each. `optics` are those of the material.
[[nodiscard]] std::vector<std::string> doubts_of(const Material& material, const Optics& optics);

/// What bssrdf.h takes, for positions in units of `unit` lengths (those that the coefficients are inverse to); S then
/// is in the inverse square of that unit. A channel that doesn't scatter gets scale 0.
[[nodiscard]] kernels::ExactMedium exact_medium(const ChannelConstants& channel, Model model, double unit);
[[nodiscard]] kernels::Medium device_medium(const ChannelConstants& channel, Model model, double unit);
[[nodiscard]] kernels::ExactBoundary exact_boundary(const ChannelConstants& channel);
/// The same without a medium, which works out the moments.
[[nodiscard]] kernels::ExactBoundary exact_boundary(double eta);
[[nodiscard]] kernels::Boundary device_boundary(const kernels::ExactBoundary& boundary);
/// bssrdf.h's S_d of a model in double, without Fresnel factors, in the inverse square of the unit of the geometry.
[[nodiscard]] double exact_bssrdf(Model model, const kernels::ExactMedium& medium,
                                  const kernels::ExactBoundary& boundary, const kernels::DipoleGeometry& geometry);

/// A row of the table of measured materials that Parian ships.
struct MeasuredMaterial {
  Material material;
  std::string dataset;
};
[[nodiscard]] const std::vector<MeasuredMaterial>& measured_materials();

/// Looks a measured material up by name; case, spaces, '-' and '_' are ignored. Throws Error(input) with the nearest
/// names when there is none.
[[nodiscard]] Material find_material(const std::string& name);

}  // namespace parian
