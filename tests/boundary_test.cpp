// Fresnel, refraction and bent normals of bssrdf.h, in double and in float32 on the OpenCL device.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/bssrdf.h"
#include "scene/medium.hpp"
#include "test_device.hpp"

namespace parian {
namespace {

using kernels::real3;

/// Fresnel and bent normal of VW directions per work-item: seven rows of `count`: T, w12, bent normal.
const char* const boundary_kernel = R"(
__kernel void at_boundary(__global const Boundary* restrict b, __global const real* restrict n,
                          __global const real* restrict w, uint count, __global real* restrict out) {
  const uint i = (uint)get_global_id(0);
  if (i >= count) return;
  const real3 n_i = real3_make(n[i], n[i + count], n[i + 2 * count]);
  const real3 w_i = real3_make(w[i], w[i + count], w[i + 2 * count]);
  const real3 w12 = refract_into(w_i, n_i, b[0]), bent = bend_normal(n_i, w_i);
  out[i] = fresnel_transmittance(real3_dot(n_i, w_i), b[0]);
  out[i + count] = w12.x;
  out[i + 2 * count] = w12.y;
  out[i + 3 * count] = w12.z;
  out[i + 4 * count] = bent.x;
  out[i + 5 * count] = bent.y;
  out[i + 6 * count] = bent.z;
}
)";

/// 1 - R by the textbook form of Fresnel's equations.
double transmittance(long double c, long double eta) {
  const long double c_t = std::sqrt(1 - (1 - c * c) / (eta * eta));
  const long double s = (c - eta * c_t) / (c + eta * c_t), p = (eta * c - c_t) / (eta * c + c_t);
  return static_cast<double>(1 - (s * s + p * p) / 2);
}

constexpr std::size_t count = 4096;

/// Three rows each of normals and directions: +z turned about a slanted axis, and light from every height, grazing and
/// from behind too.
std::array<std::vector<float>, 2> normals_and_directions() {
  const real3 normal = {2.0 / 7, 3.0 / 7, 6.0 / 7}, side = {6.0 / 7, 2.0 / 7, -3.0 / 7};
  std::vector<float> n, w;
  for (int axis = 0; axis < 3; ++axis)
    for (std::size_t i = 0; i < count; ++i) {
      const double c = std::copysign(std::pow(2.0 * double(i) / (count - 1) - 1, 4), double(i) - count / 2.0);
      const real3 d = kernels::real3_madd(kernels::real3_scale(normal, c), side, std::sqrt(1 - c * c));
      n.push_back(float(axis == 0 ? normal.x : axis == 1 ? normal.y : normal.z));
      w.push_back(float(axis == 0 ? d.x : axis == 1 ? d.y : d.z));
    }
  return {n, w};
}

TEST(Boundary, AgreesWithTheTextbookFormAndKeepsItsPromises) {
  const auto [n, w] = normals_and_directions();
  TestDevice device;
  double worst_T = 0, worst_w = 0, worst_exact_T = 0, worst_length = 0, worst_cosine = 0;
  for (const double eta : {0.6, 0.9, 0.999999, 1.0, 1.000001, 1.0001, 1.3, 1.5, 2.4, 10.0}) {
    for (const int width : {1, 8}) {
      const std::vector<float> out = device.run(
          boundary_kernel, fmt::format("-DVW={}", width), "at_boundary", count / width, 7 * count,
          {device.buffer(std::vector{device_boundary(exact_boundary(eta))}), device.buffer(n), device.buffer(w)});
      const auto row = [&](const std::vector<float>& v, std::size_t first, std::size_t i) {
        return real3{v[first * count + i], v[(first + 1) * count + i], v[(first + 2) * count + i]};
      };
      for (std::size_t i = 0; i < count; ++i) {
        SCOPED_TRACE(fmt::format("eta {:a}, i {}", eta, i));
        const real3 n_i = row(n, 0, i), w_i = row(w, 0, i), w12 = row(out, 1, i), bent = row(out, 4, i);
        const double c = kernels::real3_dot(n_i, w_i);
        const kernels::ExactBoundary b = exact_boundary(eta);
        const double T = kernels::fresnel_transmittance(c, b);
        // T has a vertical tangent at the critical angle: rounding of c^2 counts 1e-7 / (2 q).
        const double q = std::sqrt(std::max(b.eta_sq_minus_1 + c * c, 0.0));
        const double slope = 1 + 1 / std::max(q, 3e-4);
        if (c > 1e-4 && q > 1e-4) {  // where the textbook form has digits left
          worst_exact_T = std::max(worst_exact_T, std::fabs(T - transmittance(c, eta)));
        } else if (c <= 0 || q == 0) {
          ASSERT_EQ(T, 0);
        }
        ASSERT_TRUE(out[i] >= 0 && out[i] <= 1);
        worst_T = std::max(worst_T, std::fabs(out[i] - T) / slope);
        const real3 off = kernels::real3_sub(w12, kernels::refract_into(w_i, n_i, b));
        worst_w = std::max(worst_w, std::sqrt(kernels::real3_dot(off, off)) / slope);
        ASSERT_TRUE(std::isfinite(w12.x + w12.y + w12.z));
        const real3 expected = kernels::bend_normal(n_i, w_i);
        if (std::fabs(c - 0.01) < 1e-6) continue;
        if (c > 0.01) {
          ASSERT_TRUE(bent.x == n_i.x && bent.y == n_i.y && bent.z == n_i.z);
          continue;
        }
        worst_length = std::max(worst_length, std::fabs(kernels::real3_dot(bent, bent) - 1));
        worst_cosine = std::max(worst_cosine, std::fabs(kernels::real3_dot(bent, w_i) - 0.01));
        ASSERT_NEAR(kernels::real3_dot(expected, w_i), 0.01, 3e-7);  // w_i is unit to float32 only
      }
    }
  }
  fmt::print("boundary: T {:.2g} (double {:.2g}), w12 {:.2g}, bent length^2 {:.2g}, cosine {:.2g}\n", worst_T,
             worst_exact_T, worst_w, worst_length, worst_cosine);
  EXPECT_LE(worst_exact_T, 1e-11);
  EXPECT_LE(worst_T, 1e-6);  // a few roundings of float32
  EXPECT_LE(worst_w, 1e-6);
  EXPECT_LE(worst_length, 1e-6);
  EXPECT_LE(worst_cosine, 1e-6);
}

TEST(Boundary, BendsTowardsTheDirectionEvenFromOpposite) {
  const real3 w = {0, 0.6, 0.8};
  for (const real3& n : {real3{0, -0.6, -0.8}, real3{0, 0.8, -0.6}, real3{1, 0, 0}, real3{0.6, -0.48, -0.64}}) {
    const real3 bent = kernels::bend_normal(n, w);
    EXPECT_NEAR(kernels::real3_dot(bent, w), 0.01, 1e-11);
    EXPECT_NEAR(kernels::real3_dot(bent, bent), 1, 1e-10);  // sqrt(1 - 0.01^2) is written to eleven digits
    EXPECT_NEAR(kernels::real3_dot(kernels::real3_cross(n, w), bent), 0, 1e-12);  // stays in the plane of n and w
  }
}

}  // namespace
}  // namespace parian
