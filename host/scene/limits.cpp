// The limits' words, and the checks of what has several.
#include "scene/limits.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/words.hpp"

namespace parian {
namespace {

bool finite(glm::dvec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

std::optional<Problem> outside(const char* field, double value, const Interval& limit) {
  if (limit.holds(value)) return {};
  return Problem{field, fmt::format("is {}; give {}", value, limit.text())};
}

std::optional<Problem> outside(const char* field, glm::dvec3 value, const Interval& limit) {
  for (int c = 0; c < 3; ++c)
    if (!limit.holds(value[c]))
      return Problem{field, fmt::format("is {} in channel {}; give {}", value[c], "RGB"[c], limit.text())};
  return {};
}

[[noreturn]] void fail(const std::string& what) { throw Error(ErrorKind::input, what); }

}  // namespace

std::string Interval::text() const {
  const std::string from = fmt::format("a number {} {}", above ? "above" : "from", least);
  if (most == no_limit) return above ? from : from + " on";
  return fmt::format("{}{} {}", from, below ? " and below" : above ? ", at most" : " to", most);
}

bool WholeSetting::holds(double x) const { return x >= least && x <= most && std::floor(x / step) * step == x; }

std::string WholeSetting::text() const {
  return fmt::format("{} number from {} to {}", step == 2 ? "an even" : "a whole", least, most);
}

std::optional<Problem> problem_of(const Material& material) {
  if (auto problem = outside("ior", material.ior, ior_limit)) return problem;
  if (auto problem = outside("sigma_s", material.sigma_s, coefficient_limit)) return problem;
  if (auto problem = outside("sigma_a", material.sigma_a, coefficient_limit)) return problem;
  if (auto problem = outside("g", material.g, g_limit)) return problem;
  for (int c = 0; c < 3; ++c) {
    const double reduced = (1 - material.g[c]) * material.sigma_s[c] + material.sigma_a[c];
    if (!(reduced >= least_reduced))
      return Problem{"sigma_s (1 - g) + sigma_a",
                     fmt::format("is {} in channel {}; give it scattering or absorption", reduced, "RGB"[c])};
  }
  return {};
}

std::optional<Problem> problem_of(const DirectionalLight& light) {
  const double length = glm::length(light.towards);
  if (!(length > 0)) return Problem{"towards", "has no length, and so no direction; give another"};
  if (!std::isfinite(length)) return Problem{"towards", "has a length that is no number; give another direction"};
  return outside("irradiance", light.irradiance, irradiance_limit);
}

std::optional<Problem> problem_of(const Camera& camera) {
  for (const auto& [field, value] : {std::pair{"eye", camera.eye}, {"target", camera.target}, {"up", camera.up}})
    if (!finite(value)) return Problem{field, "has a coordinate that is not finite; give numbers"};
  if (!(glm::length(camera.target - camera.eye) > 0)) return Problem{"eye", "and target are the same point; move one"};
  return outside("fov", camera.fov, fov_limit);
}

std::optional<Problem> problem_of(const Settings& settings) {
  for (const NumberSetting& s : number_settings)
    if (auto problem = outside(s.name, settings.*s.member, s.limit)) return problem;
  for (const WholeSetting& s : whole_settings)
    if (!s.holds(settings.*s.member))
      return Problem{s.name, fmt::format("is {}; give {}", settings.*s.member, s.text())};
  return {};
}

void validate(const Material& material, const std::string& place) {
  if (const auto problem = problem_of(material)) fail(place + ": " + problem->text());
}

void check_bounds(const MeshBounds& m) {
  if (!finite(m.centre) || !(m.radius >= 0 && std::isfinite(m.radius)))
    fail(
        fmt::format("mesh: a sphere of radius {} doesn't hold it; give a finite centre and a radius above 0, or 0 to "
                    "have it measured",
                    m.radius));
}

void check_lights(const std::vector<DirectionalLight>& lights) {
  for (std::size_t i = 0; i < lights.size(); ++i)
    if (const auto problem = problem_of(lights[i])) fail(fmt::format("light {}: {}", i + 1, problem->text()));
}

void check_cameras(const std::vector<Camera>& cameras, glm::uvec2 film) {
  const auto side = [](glm::uint pixels) { return pixels >= 1 && pixels <= largest_film_side; };
  if (!side(film.x) || !side(film.y))
    fail(fmt::format("film of {} x {} pixels; give sides from 1 to {}", film.x, film.y, largest_film_side));
  for (std::size_t i = 0; i < cameras.size(); ++i)
    if (const auto problem = problem_of(cameras[i])) fail(fmt::format("camera {}: {}", i + 1, problem->text()));
}

void check_kept(const Settings& settings) {
  for (const std::string& name : settings.keep)
    if (name != "all" && std::find(omission_names.begin(), omission_names.end(), name) == omission_names.end())
      throw Error(ErrorKind::usage, fmt::format("{} {}: nothing of that name is ever left out; choose all or one of {}",
                                                setting("keep"), name, fmt::join(omission_names, ", ")));
}

void check_samples(const Settings& settings) {
  if (std::uint64_t{settings.frames} * settings.samples >= std::uint64_t{1} << 32)
    throw Error(ErrorKind::usage, fmt::format("{} times {} must stay below 2^32, where sample numbers end; lower one",
                                              setting("frames"), setting("samples")));
}

}  // namespace parian
