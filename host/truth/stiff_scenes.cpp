// The table of stiff scenes, and the plane's radiance by quadrature.
#include "truth/stiff_scenes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/bssrdf.h"
#include "truth/compare.hpp"
#include "truth/half_space.hpp"
#include "truth/reference.hpp"

namespace parian {
namespace {

using Change = std::function<void(Scene&, Settings&)>;

// A film of 64 pixels with 256 samples each at 64 positions: what is left of noise in a mean is a few tenths of a
// percent, in single pixels a few percent; layers of 128 texels and light maps of 256 to 512 add a bias of as much.
constexpr double mean_tolerance = 0.02, relmse_tolerance = 5e-3;

/// The ordinary scene and settings as users render, changed.
struct Stiff {
  Scene scene = ordinary_scene();
  Settings settings = ordinary_settings();
  explicit Stiff(const Change& change) {
    scene.film = {8, 8};
    settings.gather = Gather::layers;
    settings.layers = 8;
    settings.layer_size = 128;
    settings.light_map_size = 256;
    settings.frames = 16;
    change(scene, settings);
  }
};

/// Relative errors of the three channels' means, the worst of them, and relMSE, where the reference is Monte Carlo too.
Finding near_reference(Trial& trial, const Change& change) {
  const Stiff t(change);
  ReferenceSettings settings;
  settings.model = t.settings.model;
  settings.target = 1e-3;  // its variance is taken off the measured error
  ReferenceState state;
  render_reference(t.scene, settings, state);
  const Comparison c = compare(trial.render(t.scene, t.settings).image, reference_image(state));
  double mean = 0;
  for (const double ratio : c.mean_ratio) mean = std::max(mean, std::isnan(ratio) ? INFINITY : std::fabs(ratio - 1));
  if (!(mean <= mean_tolerance)) return {mean, mean_tolerance, "mean radiance off the reference's"};
  return {c.relmse, relmse_tolerance, fmt::format("relMSE; means off by {:.2g}", mean)};
}

/// A plate of 100 mm, wide enough for its middle to be an infinite plane's, lit at `cosine` and seen from far above.
void plate_seen_from_above(Scene& scene, double cosine) {
  scene.mesh = plate_mesh();
  scene.lights[0] = {{std::sqrt(1 - cosine * cosine), 0, cosine}, glm::dvec3(1)};
  scene.cameras[0] = {{3, 2, 400}, {3, 2, 0}, {0, 1, 0}, 3};
}

/// Mean radiance of each channel over that of the plane.
std::array<double, 3> share_of_plane(const Image& image, const Scene& scene, Model model, double cosine) {
  std::array<double, 3> share{};
  for (std::size_t i = 0; i < image.rgba.size(); ++i)
    if (i % 4 < 3) share[i % 4] += 4.0 * image.rgba[i] / static_cast<double>(image.rgba.size());
  const Optics optics = optics_of(scene.material);
  const double T21 = kernels::fresnel_transmittance(1.0, optics.boundary);
  for (std::size_t c = 0; c < 3; ++c) share[c] /= T21 * plane_radiance(optics.channels[c], model, cosine);
  return share;
}

/// A plate of `material` under light at `cosine` is as bright as an infinite plane.
Finding near_plane(Trial& trial, const Material& material, double cosine) {
  const Stiff t([&](Scene& scene, Settings& settings) {
    plate_seen_from_above(scene, cosine);
    scene.material = material;
    settings.light_map_size = 512;
    settings.frames = 32;
  });
  const std::array<double, 3> share =
      share_of_plane(trial.render(t.scene, t.settings).image, t.scene, t.settings.model, cosine);
  Finding f{0, mean_tolerance, "radiance off an infinite plane's"};
  for (const double s : share) f.error = std::max(f.error, std::isnan(s) ? INFINITY : std::fabs(s - 1));
  return f;
}

/// A texel of the light map is a hundred times as wide as the path: right on a plane, and a warning, since it would not
/// be on a curved surface.
Finding path_within_a_texel(Trial& trial) {
  const Material material = medium_of(225, 25);  // 0.004 mm; a texel has 0.4 mm
  const Stiff t([&](Scene& scene, Settings&) {
    plate_seen_from_above(scene, 0.5);
    scene.material = material;
  });
  const Statistics statistics = trial.render(t.scene, t.settings).statistics;
  bool warned = false;
  for (const std::string& warning : statistics.warnings)
    warned = warned || warning.find("is short for an object") != std::string::npos;
  if (!warned) return {INFINITY, 0, "no warning that the path is short"};
  return near_plane(trial, material, 0.5);
}

Material one_dense_channel() {
  Material m = medium_of(0.9, 0.1);
  m.sigma_s.z *= 1e4, m.sigma_a.z *= 1e4;
  return m;
}

}  // namespace

double plane_radiance(const ChannelConstants& channel, Model model, double cosine) {
  return cosine * dipole_albedo(channel, model, cosine) / (4 * std::numbers::pi * channel.C_phi_inv);
}

const std::vector<StiffScene>& stiff_scenes() {
  const auto plate = [](double sigma_s, double sigma_a, double cosine) {
    return [=](Trial& trial) { return near_plane(trial, medium_of(sigma_s, sigma_a), cosine); };
  };
  const auto sphere = [](const Change& change) { return [=](Trial& trial) { return near_reference(trial, change); }; };
  // Much nearer than a path, the directional model is a spike around mu0 = 0 that no estimator finds: see physics.
  const auto clear = [&](double path) {
    return sphere([=](Scene& scene, Settings& settings) {
      scene.material = medium_of(0.9 / path, 0.1 / path);
      settings.model = Model::standard;
    });
  };
  static const std::vector<StiffScene> scenes{
      {"ordinary", "as the reference", sphere([](Scene&, Settings&) {})},
      {"albedo 1 - 1e-7", "as the reference",
       sphere([](Scene& scene, Settings&) { scene.material = medium_of(1, 1e-7); })},
      {"path as long as the object", "as the reference",
       sphere([](Scene& scene, Settings&) { scene.material = medium_of(0.0099, 0.0001); })},
      {"path 1e2 of the object", "as the reference, standard model", clear(1e4)},
      {"path 1e4 of the object", "as the reference, standard model", clear(1e6)},
      {"1e6 mm from the origin", "as the reference", sphere([](Scene& scene, Settings&) {
         const glm::dvec3 away(1e6, -3e5, 7e5);
         for (glm::dvec3& p : scene.mesh.positions) p += away;
         scene.cameras[0].eye += away, scene.cameras[0].target += away;
       })},
      {"needles of 1e4 to 1", "as the reference", sphere([](Scene& scene, Settings&) {
         for (glm::dvec3& p : scene.mesh.positions)
           if (std::fabs(p.y) < 40) p.y *= 1e-4;
       })},
      {"path 1e-2 of the object", "as an infinite plane", plate(0.9, 0.1, 0.5)},
      {"path 1e-3 of the object", "as an infinite plane", plate(9, 1, 0.5)},
      {"grazing light, 3 degrees", "as an infinite plane",
       [](Trial& trial) { return near_plane(trial, medium_of(0.9, 0.1), 0.05); }},
      {"one channel 1e4 denser", "as an infinite plane",
       [](Trial& trial) { return near_plane(trial, one_dense_channel(), 0.5); }},
      {"texel 100 times the path", "as an infinite plane, and a warning", path_within_a_texel}};
  return scenes;
}

}  // namespace parian
