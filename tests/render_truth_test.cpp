// Whole renders against integrals computed here in double, and what a render says of itself.
#include "kernels/bssrdf.h"

#include "test_render.hpp"

namespace parian {
namespace {

using namespace test;
using kernels::real3;

/// S for light that comes in along the normal of a plane, at distance r on it; it doesn't depend on the direction.
double plane_S(const Material& m, Model model, double r) {
  const ChannelConstants constants = channel_constants(m.sigma_s.x, m.sigma_a.x, m.g.x, m.ior);
  const kernels::ExactMedium medium = exact_medium(constants, model, 1.0);
  const kernels::ExactBoundary boundary = exact_boundary(m.ior);
  const real3 n{0, 0, 1};
  const kernels::DipoleGeometry g = kernels::dipole_geometry({r, 0, 0}, {0, 0, -1}, n, n);
  return model == Model::directional ? kernels::directional_dipole(medium, boundary, g)
         : model == Model::standard  ? kernels::standard_dipole(medium, g)
                                     : kernels::better_dipole(medium, g);
}

/// The integral of S over a square of that side around its centre: Simpson's rule over log r, where S is smooth on
/// every scale, and over the angle in an eighth of the square. Halving either step changes less than 1e-6 of it.
double integral_over_square(const Material& m, Model model, double side) {
  constexpr int radii = 2000, angles = 16;
  constexpr double pi = std::numbers::pi;
  double total = 0.0;
  for (int a = 0; a <= angles; ++a) {
    const double low = std::log(1e-6), high = std::log(0.5 * side / std::cos(0.25 * pi * a / angles));
    const double step = (high - low) / radii;
    double sum = 0.0;
    for (int i = 0; i <= radii; ++i) {
      const double r = std::exp(low + i * step);
      sum += plane_S(m, model, r) * r * r * (i == 0 || i == radii ? 1.0 : i % 2 ? 4.0 : 2.0);
    }
    total += sum * step / 3.0 * (a == 0 || a == angles ? 1.0 : a % 2 ? 4.0 : 2.0);
  }
  return 8.0 * total * (0.25 * pi / angles) / 3.0;
}

// Light falls straight on the face of a slab 100 x 100 x 10; the camera looks straight at a spot of 6 mm in its middle.
// 4096 samples of a smooth integral at each of hundreds of texels leave noise of 1e-5, seen where light is slanted
// 1e-4; nearly all of the tolerance is for the far edges, which a light-map texel blurs.
TEST(RenderTruth, MiddleOfASlab) {
  for (const auto& [name, model] : {std::pair("directional", Model::directional),
                                    std::pair("standard", Model::standard), std::pair("better", Model::better)}) {
    Scene scene = bare_scene(box({100, 100, 10}), material(2.0, 0.01, 1.5), {16, 16});
    scene.lights[0] = {{0, 0, 1}, {1.0, 2.0, 4.0}};
    scene.cameras[0] = {{0, 0, 205}, {0, 0, 0}, {0, 1, 0}, 1.7};
    Settings settings = small_settings();
    settings.model = model;
    settings.samples = 512;
    settings.light_map_size = 256;
    settings.pyramids = false;
    const Rendered r = render(scene, settings, 8);
    expect_sane(r, name);
    const kernels::ExactBoundary boundary = exact_boundary(1.5);
    const double T = kernels::fresnel_transmittance(1.0, boundary);
    EXPECT_NEAR(T, 0.96, 1e-12);
    const double expected = T * T * integral_over_square(scene.material, model, 100.0);
    for (int c = 0; c < 3; ++c) {
      double sum = 0.0;
      for (std::size_t i = c; i < r.image.rgba.size(); i += 4) sum += r.image.rgba[i];
      const double ratio = sum / 256.0 / (expected * scene.lights[0].irradiance[c]);
      fmt::print("{}: {:.6g} of {:.6g} expected, ratio {:.5f}\n", name, sum / 256.0,
                 expected * scene.lights[0].irradiance[c], ratio);
      EXPECT_NEAR(ratio, 1.0, 0.001) << name;
    }
  }
}

// Light that comes in at an angle brings E cos(theta) to the face and T12 of that angle; the standard dipole knows
// nothing else of its direction. Seen at an angle too: T21 of the view, no cosine.
TEST(RenderTruth, SlantedLightAndView) {
  const double light = std::numbers::pi / 3, view = 0.8;
  Scene scene = bare_scene(box({100, 100, 10}), material(2.0, 0.01, 1.5), {16, 16});
  scene.lights[0] = {{std::sin(light), 0, std::cos(light)}, glm::dvec3(1.0)};
  scene.cameras[0] = {{0, 200 * std::sin(view), 200 * std::cos(view) + 5}, {0, 0, 5}, {0, 1, 0}, 1.0};
  Settings settings = small_settings();
  settings.model = Model::standard;
  settings.samples = 512;
  settings.light_map_size = 256;
  settings.pyramids = false;
  const Rendered r = render(scene, settings, 8);
  const kernels::ExactBoundary boundary = exact_boundary(1.5);
  const double expected = std::cos(light) * kernels::fresnel_transmittance(std::cos(light), boundary) *
                          kernels::fresnel_transmittance(std::cos(view), boundary) *
                          integral_over_square(scene.material, Model::standard, 100.0);
  const double ratio = mean_value(r.image) / expected;
  fmt::print("slanted: {:.6g} of {:.6g} expected, ratio {:.5f}\n", mean_value(r.image), expected, ratio);
  EXPECT_NEAR(ratio, 1.0, 0.001);
}

double omitted(const Statistics& s, const std::string& what) {
  double count = 0.0;
  for (const Omission& o : s.left_out) count += o.what == what ? o.count : 0.0;
  return count;
}

// With 16 layers of the figure hardly anything is unseen; what is, is sampled at the pixels themselves.
TEST(RenderStatistics, Figure) {
  Scene scene = bare_scene(model("figure"), find_material("marble"), {128, 128});
  Settings settings = small_settings();
  settings.layers = 16;
  settings.layer_size = 96;
  settings.light_map_size = 256;
  const Rendered r = render(scene, settings, 3);
  expect_sane(r, "figure");
  const Statistics& s = r.statistics;
  const auto inside = static_cast<double>(pixels_inside(r.image));
  fmt::print("figure: {:.4f} covered, {} of {} pixels without a layer, {} of {} texels, {:.3g} evaluations\n",
             s.layers_covered, s.fallback_pixels, inside, s.layers_texels_evaluated, s.layers_texels, s.evaluations);
  EXPECT_GE(s.layers_covered, 0.99);
  EXPECT_LE(s.layers_covered, 1.0);
  EXPECT_LT(static_cast<double>(s.fallback_pixels), 0.02 * inside);
  EXPECT_EQ(s.frames, 3U);
  EXPECT_LE(s.layers_count, 16U);
  EXPECT_EQ(s.layers_size, 96U);
  EXPECT_LT(s.layers_texels_evaluated, s.layers_texels);
  EXPECT_GT(s.estimated_relmse, 0.0);
  EXPECT_LT(s.estimated_relmse, 0.1);
  EXPECT_EQ(s.nonfinite, 0U);
  EXPECT_GT(s.bytes_peak, 1U << 20);
  const double at_texels = static_cast<double>(s.layers_texels_evaluated) * 3 * 3 * 16;
  EXPECT_GE(s.evaluations, at_texels);  // the rest: pixels that no layer sees
  EXPECT_LT(s.evaluations, 1.02 * at_texels);
  EXPECT_EQ(omitted(s, "unread-texels"), static_cast<double>(s.layers_texels - s.layers_texels_evaluated) * 3 * 3 * 16);
  EXPECT_GT(omitted(s, "clipping"), 0.0);
}

TEST(RenderStatistics, LightsShareTheSamples) {
  Scene scene = bare_scene(model("torus"), find_material("marble"), {32, 32});
  scene.lights = {{{1, 0, 1}, glm::dvec3(3.0)}, {{-1, 0, 1}, glm::dvec3(1.0)}, {{0, 1, 0}, glm::dvec3(0.0)}};
  Settings settings = small_settings();
  settings.layers = 8;
  const Statistics s = render(scene, settings, 2).statistics;
  EXPECT_NEAR(s.evaluations / (static_cast<double>(s.layers_texels_evaluated) * 2 * 3 * 16), 1.0, 0.02);
  bool said = false;
  for (const Omission& o : s.left_out) said = said || o.what == "dark-lights";
  EXPECT_TRUE(said);
}

}  // namespace
}  // namespace parian
