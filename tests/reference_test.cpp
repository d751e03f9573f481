// The reference against closed forms and quadrature, its own error bars, and what must not change it.
#include "truth/reference.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.hpp"
#include "kernels/bssrdf.h"
#include "scene/medium.hpp"
#include "test_render.hpp"
#include "test_scene.hpp"

namespace parian {
namespace {

using test::bare_scene;
using test::material;
using test::model;

constexpr double pi = std::numbers::pi;

/// A square of half-width `half` in the plane y = 0, seen from straight above in so few degrees that one pixel looks
/// at its centre, lit at `theta` from the normal.
Scene plane_scene(double half, const Material& of, double theta) {
  Scene scene;
  scene.mesh =
      test::mesh_of({{-half, 0, -half}, {half, 0, -half}, {half, 0, half}, {-half, 0, half}}, {0, 2, 1, 0, 3, 2});
  scene.material = of;
  DirectionalLight light;
  light.towards = {std::sin(theta), std::cos(theta), 0};
  light.irradiance = {2.0, 1.0, 0.5};
  scene.lights = {light};
  Camera camera;
  camera.eye = {0, half, 0};
  camera.up = {0, 0, -1};
  camera.fov = 0.5;
  scene.cameras = {camera};
  scene.film = {1, 1};
  return scene;
}

ReferenceState render(const Scene& scene, Model of, std::uint32_t samples, std::uint32_t batches,
                      std::uint64_t seed = 0, std::uint32_t threads = 2, std::uint32_t entries = 16) {
  ReferenceSettings settings;
  settings.entries = entries;
  settings.model = of;
  settings.target = 0;
  settings.samples = samples;
  settings.seed = seed;
  settings.threads = threads;
  ReferenceState state;
  render_reference(scene, settings, state, [&](std::uint32_t done, double) { return done < batches; });
  return state;
}

/// Unpolarised power reflectance from the cosine outside, as Fresnel's equations are printed.
double reflectance(double c, double eta) {
  const double t = std::sqrt(1 - (1 - c * c) / (eta * eta));
  const double s = (c - eta * t) / (c + eta * t), p = (eta * c - t) / (eta * c + t);
  return 0.5 * (s * s + p * p);
}

/// The picture's largest difference from `expected` (RGB), relative, and the standard errors it lies within.
void expect_radiance(const ReferenceState& state, glm::dvec3 expected, double tolerance, const std::string& what) {
  const Image image = reference_image(state);
  for (int c = 0; c < 3; ++c) {
    const double relative = state.mean[c] / expected[c] - 1, error = image.standard_error[c] / expected[c];
    fmt::print("{} channel {}: off by {:.2e}, standard error {:.2e}\n", what, c, relative, error);
    EXPECT_LT(std::abs(relative), tolerance) << what << ", channel " << c;
    // Four standard errors of noise must fit beside it, or the comparison shows nothing.
    EXPECT_LT(4 * error, tolerance) << what << ", channel " << c;
  }
}

TEST(ReferenceTest, StandardDipoleOnAPlaneHasItsClosedForm) {
  const double sigma_s_prime = 1.0, sigma_a = 0.05, eta = 1.3;
  const double sigma_t = sigma_s_prime + sigma_a, q = std::sqrt(3 * sigma_a / sigma_t);
  const double F = -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta, A = (1 + F) / (1 - F);
  const double R_d = 0.5 * (sigma_s_prime / sigma_t) * (1 + std::exp(-4.0 / 3 * A * q)) * std::exp(-q);
  const double half = 16 / (q * sigma_t);  // what lies beyond is less than 1e-6 of the whole
  for (const double degrees : {0.0, 60.0}) {
    const double c = std::cos(degrees * pi / 180);
    const double factor = (1 - reflectance(1, eta)) * (1 - reflectance(c, eta)) * c * R_d / pi;
    const auto state = render(plane_scene(half, material(sigma_s_prime, sigma_a, eta), degrees * pi / 180),
                              Model::standard, 800, 16, 0, 1, 1024);
    EXPECT_EQ(state.mean[3], 1.0);
    expect_radiance(state, factor * glm::dvec3(2, 1, 0.5), 1e-3, fmt::format("standard dipole, {} degrees", degrees));
  }
}

/// The integral of S_d over the plane in polar coordinates, radii by r = exp(t), for light from `theta`.
double directional_total(const kernels::ExactMedium& medium, double eta, double theta, double reach) {
  const kernels::ExactBoundary boundary = exact_boundary(eta);
  const kernels::real3 n{0, 1, 0}, w_i{std::sin(theta), std::cos(theta), 0};
  const kernels::real3 w12 = kernels::refract_into(w_i, n, boundary);
  constexpr int radii = 4000, angles = 360;
  const double low = std::log(1e-5), high = std::log(reach);
  double sum = 0;
  for (int i = 0; i < radii; ++i) {
    const double r = std::exp(low + (high - low) * (i + 0.5) / radii);
    for (int k = 0; k < angles; ++k) {
      const double phi = 2 * pi * (k + 0.5) / angles;
      const kernels::real3 x{r * std::cos(phi), 0, r * std::sin(phi)};
      sum += kernels::directional_dipole(medium, boundary, kernels::dipole_geometry(x, w12, n, n)) * r * r;
    }
  }
  return sum * (high - low) / radii * 2 * pi / angles;
}

TEST(ReferenceTest, DirectionalDipoleOnAPlaneAgreesWithQuadrature) {
  const double eta = 1.3, half = 80;
  Material medium = material(1.0, 0.05, eta);
  medium.sigma_s = {0.6, 2.0, 5.0};  // three different media
  medium.g = {0.0, 0.3, 0.0};
  for (const double degrees : {0.0, 60.0}) {
    const double theta = degrees * pi / 180, c = std::cos(theta);
    const auto state = render(plane_scene(half, medium, theta), Model::directional, 800, 16, 0, 1, 1024);
    glm::dvec3 expected;
    for (int k = 0; k < 3; ++k) {
      const auto constants = channel_constants(medium.sigma_s[k], medium.sigma_a[k], medium.g[k], eta);
      expected[k] = (1 - reflectance(1, eta)) * (1 - reflectance(c, eta)) * c *
                    directional_total(exact_medium(constants, Model::directional, 1.0), eta, theta, half);
    }
    expect_radiance(state, expected * glm::dvec3(2, 1, 0.5), 1e-3,
                    fmt::format("directional dipole, {} degrees", degrees));
  }
}

Scene small_scene(const std::string& name, double size_mm = 100.0, std::uint32_t pixels = 32) {
  return bare_scene(model(name, size_mm), find_material("marble"), {pixels, pixels});
}

// A film's mean z^2 is that of a normal deviate, 1, up to the heavier tail of a variance from 64 batches: that alone
// puts 0.32 % beyond 3. The channels of a pixel share their samples, so that tells only over all pairs together.
TEST(ReferenceTest, TwoSeedsDifferByTheirStandardErrors) {
  std::size_t all = 0, beyond = 0;
  const std::uint32_t pixels = deep() ? 40 : 26;
  for (const char* name : {"figure", "torus"}) {
    const Scene scene = small_scene(name, 100.0, pixels);
    std::vector<Image> images;
    for (const std::uint64_t seed : {1, 2, 3})
      images.push_back(reference_image(render(scene, Model::directional, 1, 64, seed)));
    double sum = 0;
    std::size_t count = 0;
    test::Worst worst;
    for (std::size_t pair = 0; pair < 3; ++pair) {
      const Image &a = images[pair], &b = images[(pair + 1) % 3];
      for (std::size_t i = 0; i < a.standard_error.size() / 3; ++i) {
        if (std::min(a.rgba[4 * i + 3], b.rgba[4 * i + 3]) < fully_covered) continue;
        for (int c = 0; c < 3; ++c) {
          const double z = (a.rgba[4 * i + c] - b.rgba[4 * i + c]) /
                           std::hypot(double{a.standard_error[3 * i + c]}, double{b.standard_error[3 * i + c]});
          sum += z * z;
          beyond += !(std::abs(z) <= 3);
          ++count;
          worst.add(std::abs(z), fmt::format("pixel {},{} channel {}", i % pixels, i / pixels, c));
        }
      }
    }
    ASSERT_GT(count, 900U) << name;
    all += count;
    const double mean = sum / double(count);
    fmt::print("{}: mean z^2 {:.3f} of {}, at most |z| {:.2f} at {}\n", name, mean, count, worst.value, worst.where);
    EXPECT_GT(mean, 0.8) << name;
    EXPECT_LT(mean, 1.2) << name;
  }
  fmt::print("|z| > 3 in {:.2f} % of {}\n", 100.0 * double(beyond) / double(all), all);
  EXPECT_LE(double(beyond) / double(all), 0.005);
}

/// Largest difference between two pictures' RGB in their joint standard errors, over pixels covered in part or fully.
double largest_z(const Image& a, const Image& b) {
  test::Worst worst;
  for (std::size_t i = 0; i < a.standard_error.size(); ++i) {
    const std::size_t at = i / 3 * 4 + i % 3;
    const double error = std::hypot(double{a.standard_error[i]}, double{b.standard_error[i]});
    if (error > 0) worst.add(std::abs(a.rgba[at] - b.rgba[at]) / error, "");
  }
  return worst.value;
}

/// Ratio of the pictures' mean values.
double ratio(const Image& a, const Image& b) { return test::mean_value(a) / test::mean_value(b); }

/// Standard error of that ratio's distance from 1; the channels of a pixel err together.
double ratio_error(const Image& a, const Image& b) {
  double variance = 0;
  for (const Image* image : {&a, &b}) {
    for (std::size_t i = 0; i < image->standard_error.size(); i += 3) {
      const double sum = double{image->standard_error[i]} + image->standard_error[i + 1] + image->standard_error[i + 2];
      variance += sum * sum;
    }
  }
  return std::sqrt(variance) / (test::mean_value(b) * static_cast<double>(b.standard_error.size()));
}

TEST(ReferenceTest, ThreadsDontMatter) {
  const Scene scene = small_scene("concave");
  const Image one = reference_image(render(scene, Model::directional, 1, 3, 7, 1));
  const Image three = reference_image(render(scene, Model::directional, 1, 3, 7, 3));
  EXPECT_TRUE(test::same_bits(one, three)) << test::difference(one, three);
  EXPECT_EQ(one.standard_error, three.standard_error);
  const Image other = reference_image(render(scene, Model::directional, 1, 3, 8, 1));
  EXPECT_FALSE(test::same_bits(one, other));
}

TEST(ReferenceTest, ContinuedIsTheSameAsInOneRun) {
  const Scene scene = small_scene("torus");
  const auto whole = render(scene, Model::better, 2, 20, 3);
  ReferenceState half = render(scene, Model::better, 2, 16, 3);
  half = reference_state(reference_image(half), half.batches, half.samples);
  ReferenceSettings settings;
  settings.model = Model::better;
  settings.target = 0;
  settings.seed = 3;
  render_reference(scene, settings, half, [](std::uint32_t done, double) { return done < 20; });
  ASSERT_EQ(half.batches, 20U);
  EXPECT_EQ(half.samples, 2U);
  // The picture in between has single precision: 6e-8 of the mean, and of the standard error, which squares.
  test::Worst worst;
  for (std::size_t i = 0; i < whole.mean.size(); ++i)
    if (whole.mean[i] > 0) worst.add(std::abs(half.mean[i] / whole.mean[i] - 1), fmt::format("value {}", i));
  fmt::print("continued: off by {:.2e} at {}\n", worst.value, worst.where);
  EXPECT_LT(worst.value, 2e-7) << worst.where;
  EXPECT_NEAR(own_relmse(half), own_relmse(whole), 1e-5 * own_relmse(whole));
}

TEST(ReferenceTest, StopsAtItsTargetAndNotBeforeSixteenBatches) {
  ReferenceSettings settings;
  settings.samples = 1;
  settings.threads = 2;
  settings.target = 1e-2;
  ReferenceState state;
  const Scene scene = small_scene("sphere", 100.0, 16);
  render_reference(scene, settings, state);
  EXPECT_GE(state.batches, least_batches);
  EXPECT_LT(own_relmse(state), settings.target);
  const auto batches = state.batches;
  render_reference(scene, settings, state);  // nothing is left to do
  EXPECT_EQ(state.batches, batches);
}

TEST(ReferenceTest, UnitsDontMatter) {
  const Scene scene = small_scene("figure");
  Scene large = small_scene("figure");
  const glm::dvec3 far(1e6, -2e6, 3e6);
  for (glm::dvec3& p : large.mesh.positions) p = 1000.0 * p + far;
  large.cameras[0].eye = 1000.0 * large.cameras[0].eye + far;
  large.cameras[0].target = far;
  large.material.sigma_s /= 1000.0;
  large.material.sigma_a /= 1000.0;
  const Image a = reference_image(render(scene, Model::directional, 1, 4));
  const Image b = reference_image(render(large, Model::directional, 1, 4));
  // The same numbers are drawn, and doubles keep 1e-10 of the object at 3e6 mm; but a ray that meets an edge to within
  // single precision may change sides, and with it its pixel.
  std::size_t differ = 0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i)
    differ += std::abs(a.rgba[i] - b.rgba[i]) > 1e-4F * (a.rgba[i] + 0.01F);
  fmt::print("units: {} of {} values differ by more than 1e-4\n", differ, a.rgba.size());
  EXPECT_LE(differ, a.rgba.size() / 50);
  EXPECT_NEAR(ratio(b, a), 1.0, 0.005);
}

TEST(ReferenceTest, RotationDoesntMatter) {
  const Scene scene = small_scene("torus");
  Scene turned = scene;
  const double c = std::cos(0.7), s = std::sin(0.7);
  const auto turn = [&](glm::dvec3 v) {
    const glm::dvec3 w(c * v.x + s * v.z, v.y, c * v.z - s * v.x);
    return glm::dvec3(w.x, c * w.y - s * w.z, s * w.y + c * w.z);
  };
  for (glm::dvec3& p : turned.mesh.positions) p = turn(p);
  for (glm::vec3& n : turned.mesh.normals) n = glm::vec3(turn(glm::dvec3(n)));
  turned.cameras[0].eye = turn(scene.cameras[0].eye);
  turned.cameras[0].up = turn(scene.cameras[0].up);
  turned.lights[0].towards = turn(scene.lights[0].towards);
  const Image a = reference_image(render(scene, Model::directional, 8, 16, 1));
  const Image b = reference_image(render(turned, Model::directional, 8, 16, 2));
  const double z = largest_z(a, b), r = ratio(a, b), error = ratio_error(a, b);
  fmt::print("rotation: largest z {:.2f}, ratio of means {:.5f} +- {:.5f}\n", z, r, error);
  EXPECT_LT(z, 8);  // of Student's t with 30 degrees of freedom, 1 in 1e8
  EXPECT_LT(error, 0.005);
  EXPECT_NEAR(r, 1.0, 4 * error);
}

TEST(ReferenceTest, LightsAdd) {
  Scene scene = small_scene("concave");
  const DirectionalLight first{{0.5, 0.6, -0.6}, {3, 2, 1}}, second{{-0.2, 0.3, 0.9}, {0.5, 1, 2}};
  const auto with = [&](const std::vector<DirectionalLight>& lights, std::uint64_t seed) {
    scene.lights = lights;
    return reference_image(render(scene, Model::directional, 2, 16, seed));
  };
  const Image a = with({first}, 1), b = with({second}, 2), both = with({first, second}, 3);
  Image sum = a;
  for (std::size_t i = 0; i < sum.rgba.size(); ++i) sum.rgba[i] += b.rgba[i];
  for (std::size_t i = 0; i < sum.standard_error.size(); ++i)
    sum.standard_error[i] = std::hypot(a.standard_error[i], b.standard_error[i]);
  const double z = largest_z(sum, both), r = ratio(sum, both), error = ratio_error(sum, both);
  fmt::print("lights: largest z {:.2f}, ratio of means {:.5f} +- {:.5f}\n", z, r, error);
  EXPECT_LT(z, 8);
  EXPECT_LT(error, 0.005);
  EXPECT_NEAR(r, 1.0, 4 * error);
}

TEST(ReferenceTest, WhatIsBlackIsExactlyBlack) {
  Scene scene = small_scene("sphere", 100.0, 8);
  scene.material.sigma_s = {0.0, 1.0, 1.0};
  const auto state = render(scene, Model::directional, 1, 2);
  double green = 0;
  for (std::size_t i = 0; i < state.mean.size(); i += 4) {
    EXPECT_EQ(state.mean[i], 0.0);
    green += state.mean[i + 1];
  }
  EXPECT_GT(green, 0.0);
  scene.lights[0].irradiance = {0, 0, 0};
  const auto dark = render(scene, Model::directional, 1, 2);
  for (std::size_t i = 0; i < dark.mean.size(); i += 4)
    for (int c = 0; c < 3; ++c) EXPECT_EQ(dark.mean[i + c], 0.0);
}

TEST(ReferenceTest, FingerprintsSeeEveryInput) {
  const Scene scene = small_scene("sphere");
  const std::string own = fingerprint(scene, Model::directional);
  EXPECT_EQ(own.size(), 16U);
  EXPECT_EQ(own, fingerprint(small_scene("sphere"), Model::directional));
  EXPECT_NE(own, fingerprint(scene, Model::standard));
  const auto changed = [&](const auto& change) {
    Scene other = scene;
    change(other);
    return fingerprint(other, Model::directional);
  };
  EXPECT_NE(own, changed([](Scene& s) { s.mesh.positions[5].x += 1e-9; }));
  EXPECT_NE(own, changed([](Scene& s) { s.material.g.z = 0.1; }));
  EXPECT_NE(own, changed([](Scene& s) { s.material.ior = 1.31; }));
  EXPECT_NE(own, changed([](Scene& s) { s.lights[0].irradiance.y = 1; }));
  EXPECT_NE(own, changed([](Scene& s) { s.cameras[0].fov = 31; }));
  EXPECT_NE(own, changed([](Scene& s) { s.film.y = 33; }));
}

TEST(ReferenceTest, CoincidingTrianglesAreLitOnce) {
  Scene scene = plane_scene(20, material(1.0, 0.05), 0.0);
  const auto single = render(scene, Model::standard, 200, 16);
  const Mesh once = scene.mesh;
  for (std::size_t t = 0; t < once.triangles.size(); ++t) {  // and the other way round
    scene.mesh.triangles.push_back({once.triangles[t].x, once.triangles[t].z, once.triangles[t].y});
    for (int c = 0; c < 3; ++c) scene.mesh.normals.push_back(-once.normals[3 * t]);
  }
  const auto twice = render(scene, Model::standard, 200, 16);
  EXPECT_NEAR(twice.mean[0] / single.mean[0], 1.0, 0.02);  // noise of 0.3 %; lit twice it would be 2
}

}  // namespace
}  // namespace parian
