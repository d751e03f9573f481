// Extreme cases of media: dense and clear, white and black, and coefficients that are none.
#include <algorithm>

#include "truth/compare.hpp"
#include "truth/extreme_cases.hpp"
#include "truth/extreme_outcomes.hpp"

namespace parian {
namespace {

Finding channels_are_independent(Trial& trial) {
  const auto with_blue = [&](double factor) {
    return changed(trial, [&](Scene& scene,
                              Settings&) { scene.material.sigma_s.z *= factor, scene.material.sigma_a.z *= factor; })
        .image;
  };
  Image picture = with_blue(1e4);
  const Image& expected = trial.ordinary().image;
  for (std::size_t i = 2; i < picture.rgba.size(); i += 4) picture.rgba[i] = expected.rgba[i];
  // Samples are placed for the densest channel too, so that the others keep their values but not their noise.
  constexpr double noise = 0.02;
  return both({compare(picture, expected).relmse, noise, "relMSE of the others to the ordinary picture"},
              trial.bssrdf(medium_of(2e4, 500)));
}

/// More absorption is never brighter, from none over an albedo of 1 - 1e-7 to half.
Finding darkens_with_absorption(Trial& trial) {
  double before = inf, rise = 0;
  for (const double absorbed : {0.0, 1e-7, 1e-4, 1e-2, 0.5}) {
    const Image image =
        changed(trial, [&](Scene& scene, Settings&) { scene.material = medium_of(1 - absorbed, absorbed); }).image;
    const double mean = mean_of(image);
    rise = std::max(rise, mean / before - 1);
    before = mean;
  }
  // Samples follow the density of each material: the sums carry a little noise.
  return both({rise, 0.01, "rise of the mean"}, trial.bssrdf(medium_of(1, 1e-7)));
}

Finding refuses_bad_coefficients(Trial& trial) {
  Finding worst;
  for (const double bad : {nan, inf, -1.0})
    for (const char* name : {"sigma_s", "sigma_a", "ior", "g"}) {
      const double value = bad == -1.0 && *name == 'g' ? -1.1 : bad;
      worst = refuses(
          [&](Scene& scene, Settings&) {
            Material& m = scene.material;
            if (std::string(name) == "sigma_s") m.sigma_s.y = value;
            if (std::string(name) == "sigma_a") m.sigma_a.y = value;
            if (std::string(name) == "ior") m.ior = value;
            if (std::string(name) == "g") m.g.y = value;
          },
          {name})(trial);
      if (!worst.passed()) return worst;
    }
  return worst;
}

}  // namespace

void add_extreme_media(std::vector<ExtremeCase>& list) {
  const char* k = "optical";
  list.push_back({k, "nothing absorbed", "S_d as in double, picture finite", renders(medium_of(1, 0))});
  list.push_back({k, "nothing scattered", "exactly black, and a warning", [](Trial& trial) {
                    const auto r = changed(trial, [](Scene& s, Settings&) { s.material = medium_of(0, 1); });
                    return both(black(r.image), warned(r, "does not scatter"));
                  }});
  list.push_back({k, "vacuum", "refused",
                  refuses([](Scene& s, Settings&) { s.material = medium_of(0, 0); }, {"scattering or absorption"})});
  // The lit crescent is narrower than a pixel's distance to the next lit point: it may well be black.
  list.push_back({k, "opaque: 1e6 per mm", "S_d as in double, and a warning",
                  renders(medium_of(9.9e5, 1e4), "is short for an object", true)});
  list.push_back({k, "nearly clear: 1e-6 per mm", "S_d as in double, and a warning",
                  renders(medium_of(9.9e-7, 1e-8), "is long for an object", true)});
  list.push_back({k, "albedo 1 - 1e-7", "never brighter with more absorption", darkens_with_absorption});
  list.push_back({k, "albedo 1e-6", "S_d as in double, and a warning", renders(medium_of(1e-6, 1), "reduced albedo")});
  list.push_back({k, "one channel 1e4 denser", "the others don't change", channels_are_independent});
  for (const double ior : {1.0, 1 - 1e-6, 1 + 1e-6})
    list.push_back({k,
                    ior == 1  ? "ior 1"
                    : ior < 1 ? "ior 1 - 1e-6"
                              : "ior 1 + 1e-6",
                    "S_d as in double", renders(medium_of(1, 0.01, 0, ior))});
  list.push_back({k, "ior 0.8", "S_d as in double", renders(medium_of(1, 0.01, 0, 0.8))});
  list.push_back({k, "ior 3", "S_d as in double", renders(medium_of(1, 0.01, 0, 3))});
  list.push_back({k, "g 0.99", "S_d as in double", renders(medium_of(100, 0.01, 0.99))});
  list.push_back({k, "g -0.99", "S_d as in double", renders(medium_of(0.5, 0.01, -0.99))});
  list.push_back({k, "g 1", "exactly black: all light goes straight on", [](Trial& trial) {
                    return black(changed(trial, [](Scene& s, Settings&) { s.material = medium_of(1, 0.1, 1); }).image);
                  }});
  list.push_back({k, "NaN, infinite, negative", "refused by the coefficient's name", refuses_bad_coefficients});
}

}  // namespace parian
