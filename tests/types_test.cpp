// The structs that cross between host and device have one layout on both sides.
#include <gtest/gtest.h>

#include <cstddef>

#include "kernels/types.h"
#include "test_device.hpp"

namespace parian {
namespace {

// clang-format off
#define VIEW_FIELDS(F) F(View, origin) F(View, right) F(View, down) F(View, back) F(View, scale) F(View, centre_x) \
  F(View, centre_y) F(View, near_distance) F(View, width) F(View, height)
#define WINDOW_FIELDS(F) F(Window, x) F(Window, y) F(Window, width) F(Window, height) F(Window, sample_x) \
  F(Window, sample_y) F(Window, log_positions) F(Window, restricted) F(Window, subpixels)
#define TRIANGLE_FIELDS(F) F(RasterTriangle, x0) F(RasterTriangle, y0) F(RasterTriangle, x1) F(RasterTriangle, y1) \
  F(RasterTriangle, x2) F(RasterTriangle, y2) F(RasterTriangle, q0) F(RasterTriangle, q_x) F(RasterTriangle, q_y) \
  F(RasterTriangle, q_min) F(RasterTriangle, q_max) F(RasterTriangle, triangle)
#define LIGHT_FIELDS(F) F(Light, view) F(Light, irradiance) F(Light, sample_x) F(Light, sample_y) F(Light, samples) \
  F(Light, map) F(Light, extent)
#define DENSITY_FIELDS(F) F(Density, log_G_min) F(Density, inverse_step) F(Density, entries) F(Density, h_min) \
  F(Density, sigma) F(Density, radius)
#define MEDIUM_OFFSETS(F) F(Medium, sigma_t_prime) F(Medium, sigma_tr) F(Medium, d_e) F(Medium, z_v) \
  F(Medium, a_back) F(Medium, fluence) F(Medium, C_E) F(Medium, scale) F(Boundary, eta_sq) F(Boundary, eta_sq_minus_1) \
  F(Boundary, inverse_eta) F(Boundary, fluence)
#define ALL_FIELDS(F) \
  VIEW_FIELDS(F) WINDOW_FIELDS(F) TRIANGLE_FIELDS(F) LIGHT_FIELDS(F) DENSITY_FIELDS(F) MEDIUM_OFFSETS(F)
#define ALL_TYPES(T) T(View) T(Window) T(RasterTriangle) T(Light) T(Density) T(Medium) T(Boundary)
// clang-format on

#define TEXT_(...) #__VA_ARGS__
#define TEXT(...) TEXT_(__VA_ARGS__)
// OpenCL C has no offsetof: the distance of a member's address from its struct's.
#define DEVICE_OFFSET(T, f)                            \
  {                                                    \
    T s;                                               \
    out[i++] = (float)(uint)((char*)&s.f - (char*)&s); \
  }
#define DEVICE_SIZE(T) out[i++] = (float)sizeof(T);
#define HOST_OFFSET(T, f) names.push_back(#T "." #f), expected.push_back(offsetof(kernels::T, f));
#define HOST_SIZE(T) names.push_back("sizeof " #T), expected.push_back(sizeof(kernels::T));

TEST(Types, HaveTheSameLayoutOnHostAndDevice) {
  std::vector<std::string> names;
  std::vector<std::size_t> expected;
  ALL_TYPES(HOST_SIZE)
  ALL_FIELDS(HOST_OFFSET)
  const std::string source =
      "__kernel void layout(const uint items, __global float* out) {\n  if (get_global_id(0) > 0) return;\n  uint i = "
      "0;\n" TEXT(ALL_TYPES(DEVICE_SIZE) ALL_FIELDS(DEVICE_OFFSET)) "\n}\n";
  TestDevice device;
  const std::vector<float> found = device.run(source.c_str(), "", "layout", 1, names.size(), {});
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(found[i], static_cast<float>(expected[i])) << names[i];
    if (names[i].starts_with("sizeof")) {
      EXPECT_EQ(expected[i] % 16, 0U) << names[i] << " is not a multiple of 16 bytes";
    }
  }
}

}  // namespace
}  // namespace parian
