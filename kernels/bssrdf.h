// How a translucent surface passes light on: Fresnel boundary, geometry of a dipole, and three dipole models.
// FHK: Frisvad, Hachisuka, Kjeldsen, Directional Dipole Model for Subsurface Scattering, 2014. Directions are unit.
#ifndef PARIAN_BSSRDF_H
#define PARIAN_BSSRDF_H
#include "portable.h"
#include "types.h"

// Model that bssrdf() evaluates: 0 directional, 1 standard, 2 better. A device has no code of the others.
#ifndef MODEL
#define MODEL 0
#endif

KERNEL_HEADER_BEGIN
#ifndef __cplusplus
#pragma OPENCL FP_CONTRACT ON  // nothing in here steers control flow
#endif

// --- Boundary ---

// cos of the refracted angle times eta: sqrt(eta^2 - sin^2), 0 beyond total reflection.
SHARED real refracted_cosine(real cos_outside, CONSTANTS(Boundary) b) {
  return real_sqrt(real_max(b.eta_sq_minus_1 + cos_outside * cos_outside, real_splat(LIT(0.0))));
}

// T = 1 - R, unpolarised, from the cosine outside (FHK's T12 and T21). Fresnel's equations as 1 - r^2 = 4ab/(a+b)^2,
// which doesn't cancel when grazing; 0 from behind.
SHARED real fresnel_transmittance(real cos_outside, CONSTANTS(Boundary) b) {
  const real c = real_max(cos_outside, real_splat(LIT(0.0)));
  const real q = refracted_cosine(c, b);
  const real s = c + q, p = c * b.eta_sq + q, inverse = LIT(1.0) / real_max(s * p, real_splat(LIT(1e-36)));
  const real by_s = p * inverse, by_p = s * inverse;
  return real_min(LIT(2.0) * c * q * (by_s * by_s + b.eta_sq * by_p * by_p), real_splat(LIT(1.0)));
}

// w12: the direction into the medium of light that comes from w_i (Snell). Before the last step it is eta long but for
// the rounding of w_i and n, so that three terms of a series make it unit. Under total reflection, where the
// transmittance is 0, some tangent.
SHARED real3 refract_into(real3 w_i, real3 n, CONSTANTS(Boundary) b) {
  const real c = real3_dot(w_i, n);
  const real3 w = real3_sub(real3_scale(n, c - refracted_cosine(c, b)), w_i);
  const real length2 = real3_dot(w, w) * (b.inverse_eta * b.inverse_eta);
  return real3_scale(w, b.inverse_eta * (LIT(1.875) - length2 * (LIT(1.25) - LIT(0.375) * length2)));
}

// The axis that v is least aligned with, the first of equals.
SHARED real3 least_aligned_axis(real3 v) {
  const real x = real_abs(v.x), y = real_abs(v.y), z = real_abs(v.z);
  const real zero = real_splat(LIT(0.0)), one = real_splat(LIT(1.0));
  const real3 of_two = real3_select(y < x, real3_make(zero, one, zero), real3_make(one, zero, zero));
  return real3_select(z < real_min(x, y), real3_make(zero, zero, one), of_two);
}

// The unit vector normal to d nearest to n: d x (n x d) / |n x d| (FHK 23). For n parallel to d, nearest to an axis.
SHARED real3 normal_part(real3 n, real3 d) {
  const real3 c = real3_cross(n, d);
  const mask parallel = real3_dot(c, c) < PARALLEL_LIMIT;
  return real3_normalize(real3_cross(d, real3_select(parallel, real3_cross(least_aligned_axis(d), d), c)));
}

// n, bent towards w where that is needed to make n.w = 0.01.
SHARED real3 bend_normal(real3 n, real3 w) {
  const real3 bent =
      real3_madd(real3_scale(w, real_splat(LIT(0.01))), normal_part(n, w), real_splat(LIT(0.99994999875)));
  return real3_select(real3_dot(n, w) < LIT(0.01), bent, n);
}

// --- Geometry ---

// What all channels share of a pair of points, x = x_o - x_i in any unit, w = w12, n* the modified normal.
typedef struct {
  real r2;      // |x|^2
  real across;  // |x cross w|
  real x_w;     // x.w
  real x_n;     // x.n_o
  real w_n;     // w.n_o
  real s_w;     // n*.w
  real s_n;     // n*.n_o
} DipoleGeometry;

// n* is the unit vector along x cross (n_i cross x), so that n*.v = (n_i cross x).(v cross x) / (|n_i cross x| |x|).
// Where that is near 0/0 or out of range it is made step by step.
SHARED DipoleGeometry dipole_geometry(real3 x, real3 w12, real3 n_i, real3 n_o) {
  DipoleGeometry g;
  const real3 n_x = real3_cross(n_i, x), w_x = real3_cross(w12, x), o_x = real3_cross(n_o, x);
  g.r2 = real3_dot(x, x);
  g.across = real_sqrt(real3_dot(w_x, w_x));
  g.x_w = real3_dot(x, w12);
  g.x_n = real3_dot(x, n_o);
  g.w_n = real3_dot(w12, n_o);
  const real n_x2 = real3_dot(n_x, n_x), product = n_x2 * g.r2, scale = real_rsqrt(product);
  g.s_w = real3_dot(n_x, w_x) * scale;
  g.s_n = real3_dot(n_x, o_x) * scale;
  const mask usual = (product >= TINY) & (product <= LIT(1.0) / TINY) & (n_x2 >= PARALLEL_LIMIT * g.r2);
  if (!mask_all(usual)) {
    const real3 unit_x = real3_scale(x, real_rsqrt(real_max(g.r2, real_splat(TINY))));
    const real3 n_star = real3_select(g.r2 < TINY, n_i, normal_part(n_i, unit_x));
    g.s_w = real_select(usual, g.s_w, real3_dot(n_star, w12));
    g.s_n = real_select(usual, g.s_n, real3_dot(n_star, n_o));
  }
  return g;
}

// --- Models: S without Fresnel factors, in the inverse square of the unit of x; never negative ---

// exp(-t) and exp(-t) - 1, t cut off where float32 has nothing left.
SHARED real attenuation(real t) { return real_exp(-real_min(t, real_splat(LIT(87.0)))); }
SHARED real attenuation_minus_1(real t) { return real_expm1(-real_min(t, real_splat(LIT(87.0)))); }

// (1 + sigma d) / d^3 from u = 1/d.
SHARED real dipole_gradient(real u, real sigma) { return u * u * (u + sigma); }

#if defined(__cplusplus) || MODEL == 0
// FHK 24, 25: squared real-source distance minus r^2, in mean free paths. The floor keeps 1/d^5 in range.
SHARED real real_source_offset(CONSTANTS(Medium) m, DipoleGeometry g, real r2) {
  const real third = g.w_n * LIT(-0.33333333333333333);  // D mu0
  const real slant = LIT(2.0) * m.d_e * m.sigma_t_prime * (third * g.across) * real_rsqrt(r2 + m.d_e * m.d_e);
  const real offset = real_select(third > LIT(0.0), third * third + slant, real_splat(m.a_back));
  return real_max(offset, real_splat(LIT(1e-12)));
}

// FHK 20 without its exponential, per C_E, is B = F u + G alpha + H beta, where u = 1/d and
//   F = 3 C_phi / C_E           G = (1 + sigma d) / d^3                  H = (3 (1 + sigma d) + (sigma d)^2) / d^5
//                               alpha = F x.w + x.n_o - w.n_o            beta = (x.w) (x.n_o)
// FHK 26 subtracts B of the virtual source, nearly as large far away and at high albedo. So differences are taken
// analytically: every D.. is real minus virtual, exactly. Dot products of the virtual source follow from n* being
// normal to x. What doesn't depend on m is written so that a compiler computes it once for all channels.
SHARED real directional_dipole(CONSTANTS(Medium) m, CONSTANTS(Boundary) b, DipoleGeometry g) {
  const real sigma = real_splat(m.sigma_tr), sigma2 = sigma * sigma, F = real_splat(b.fluence);
  const real s = real_splat(m.sigma_t_prime), z_v = real_splat(m.z_v);  // s x is in mean free paths, as z_v is
  const real alpha = s * (F * g.x_w + g.x_n) - g.w_n, beta = s * s * (g.x_w * g.x_n);
  const real Dalpha = z_v * (g.s_n - F * g.s_w) - LIT(2.0) * (g.s_w * g.s_n);
  const real Dbeta = s * z_v * (g.x_w * g.s_n - g.x_n * g.s_w) + z_v * z_v * (g.s_w * g.s_n);

  const real r2 = s * s * g.r2, a_r = real_source_offset(m, g, r2), a_v = z_v * z_v;
  const real u = real_rsqrt(r2 + a_r), v = real_rsqrt(r2 + a_v), uv = u * v, sum = u + v, v2 = v * v, v3 = v2 * v;
  const real d_r = (r2 + a_r) * u, delta = (a_v - a_r) * (uv / sum), Du = delta * uv;  // delta = d_v - d_r

  // G = u gu and H = u^3 hu, with the same of v; DG and DH are Du times what follows from dividing by u - v.
  const real gu = u * (u + sigma), hu = LIT(3.0) * gu + sigma2;
  const real gv = v * (v + sigma), hv = LIT(3.0) * gv + sigma2;
  const real G_v = v * gv, H_v = v3 * hv;
  const real DG_by_Du = sum * (u + sigma) + v2;
  const real DH_by_Du = (sum * u + v2) * hu + v3 * (LIT(3.0) * sum + LIT(3.0) * sigma);

  const real B_v = F * v + G_v * (alpha - Dalpha) + H_v * (beta - Dbeta);
  const real DB = Du * (F + DG_by_Du * alpha + DH_by_Du * beta) + G_v * Dalpha + H_v * Dbeta;
  const real S = m.scale * (attenuation(sigma * d_r) * (DB - attenuation_minus_1(sigma * delta) * B_v));
  return real_max(S, real_splat(LIT(0.0)));
}
#endif

#if defined(__cplusplus) || MODEL == 1
// R_d / pi of Jensen et al., A Practical Model for Subsurface Light Transport, 2001; z_r = 1.
SHARED real standard_dipole(CONSTANTS(Medium) m, DipoleGeometry g) {
  const real r2 = g.r2 * m.sigma_t_prime * m.sigma_t_prime;
  const real sigma = real_splat(m.sigma_tr);
  const real d_r = real_sqrt(r2 + LIT(1.0)), d_v = real_sqrt(r2 + m.z_v * m.z_v);
  return m.scale * (attenuation(sigma * d_r) * dipole_gradient(LIT(1.0) / d_r, sigma) +
                    m.z_v * (attenuation(sigma * d_v) * dipole_gradient(LIT(1.0) / d_v, sigma)));
}
#endif

#if defined(__cplusplus) || MODEL == 2
// R_d / (4 pi C_phi(1/eta)) of d'Eon, A Better Dipole, 2012, with Grosjean's D; z_r = 1, the fluence terms of both
// sources subtracted analytically.
SHARED real better_dipole(CONSTANTS(Medium) m, DipoleGeometry g) {
  const real r2 = g.r2 * m.sigma_t_prime * m.sigma_t_prime;
  const real sigma = real_splat(m.sigma_tr);
  const real d_r = real_sqrt(r2 + LIT(1.0)), d_v = real_sqrt(r2 + m.z_v * m.z_v);
  const real u = LIT(1.0) / d_r, v = LIT(1.0) / d_v;
  const real delta = (m.z_v - LIT(1.0)) * (m.z_v + LIT(1.0)) / (d_r + d_v);
  const real flux = attenuation(sigma * d_r) * dipole_gradient(u, sigma) +
                    m.z_v * (attenuation(sigma * d_v) * dipole_gradient(v, sigma));
  const real fluence = attenuation(sigma * d_r) * (delta * u * v - attenuation_minus_1(sigma * delta) * v);
  return m.scale * (m.C_E * flux + m.fluence * fluence);
}
#endif

SHARED real bssrdf(CONSTANTS(Medium) m, CONSTANTS(Boundary) b, DipoleGeometry g) {
#if MODEL == 0
  return directional_dipole(m, b, g);
#elif MODEL == 1
  return standard_dipole(m, g);
#else
  return better_dipole(m, g);
#endif
}

#ifndef __cplusplus
#pragma OPENCL FP_CONTRACT OFF
#endif
KERNEL_HEADER_END
#endif
