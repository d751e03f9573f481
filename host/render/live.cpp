// What an embedder may change between frames, and images that stay on the device: nothing here waits or reads back.
#include <algorithm>
#include <cmath>

#include "passes/raster.hpp"
#include "render/image_target.hpp"
#include "render/renderer_state.hpp"

namespace parian {
namespace {

constexpr double largest_ratio = 1e30;  // of light to what was summed: what is small in float32 has few digits

bool shines(const DirectionalLight& l) { return l.irradiance.x + l.irradiance.y + l.irradiance.z > 0.0; }

}  // namespace

/// Lights that matter, of those given: not the dark ones, nor one that the plan left out although it shone, since it
/// ran along all of the surface, and still does.
std::vector<DirectionalLight> Renderer::State::taking_part(const std::vector<DirectionalLight>& lights) const {
  const bool all = kept(settings, "dark-lights");
  std::vector<DirectionalLight> some;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const DirectionalLight* before = lights.size() == scene.lights.size() ? &scene.lights[i] : nullptr;
    const bool planned = !plan.dark && std::any_of(plan.lights.begin(), plan.lights.end(),
                                                   [&](const PlannedLight& l) { return l.number == i; });
    const bool grazing = before && shines(*before) && !planned && before->towards == lights[i].towards;
    if (all || (shines(lights[i]) && !grazing)) some.push_back(lights[i]);
  }
  return some;
}

void Renderer::State::apply_changes() {
  if (!(moved || relit || anew)) return;
  if (moved) read_geometry(passes, *device_mesh);
  if (moved) passes.film.drawn.reset();
  const std::vector<glm::dvec3> sphere = sphere_points();
  for (std::size_t l = 0; l < plan.lights.size(); ++l) set_light(passes, l, relit ? &sphere : nullptr);
  compute.assign(passes.light_maps.lights_buffer, passes.light_maps.lights);
  if (moved || relit) draw_light_maps(passes, 0, settings.light_map_shift);
  if (moved || relit) epoch = 0;
  if (moved) draw_layers(passes);
  if (moved) list_covered(passes);
  if (moved || relit) find_centres(passes);
  frame = estimated_at = level = 0;
  statistics.estimated_relmse = statistics.estimated_bias_relmse = -1.0;
  moved = relit = anew = false;
}

void Renderer::set_cameras(const std::vector<Camera>& cameras, glm::uvec2 film) {
  State& s = *state_;
  std::vector<kernels::View> views;
  for (const Camera& camera : cameras) views.push_back(pinhole_view(camera, s.plan.space, film));
  with_device_errors(s.compute.info(), [&] {
    if (film != s.scene.film) {
      s.scene.film = film;
      s.passes.film.drawn.reset();
      s.allocate_film();
    }
  });
  s.scene.cameras = cameras;
  s.cameras = std::move(views);
}

/// Where colours come last, a planned light may go dark and come on again; one that was dark when planned has no sums.
bool Renderer::State::recolour(const std::vector<DirectionalLight>& lights) {
  if (lights.size() != scene.lights.size()) return false;
  std::vector<DirectionalLight> now;
  for (const PlannedLight& l : plan.lights) now.push_back(lights[l.number]);
  const auto shining = [](const std::vector<DirectionalLight>& some) {
    return std::count_if(some.begin(), some.end(), shines);
  };
  if (!kept(settings, "dark-lights") && shining(now) != shining(lights)) return false;
  for (std::size_t l = 0; l < now.size(); ++l) {
    DirectionalLight& light = passes.light_maps.given[l];
    relit = relit || light.towards != now[l].towards;
    if (plan.sums() > 1 && light.irradiance != now[l].irradiance)  // another picture, not the same one times a colour
      statistics.estimated_relmse = statistics.estimated_bias_relmse = -1.0;
    light = now[l];
  }
  if (now.size() == 1) colour = now[0].irradiance;
  return true;
}

bool Renderer::set_lights(const std::vector<DirectionalLight>& lights) {
  State& s = *state_;
  const std::vector<DirectionalLight> now = s.taking_part(lights);
  if (s.plan.dark) return now.empty();
  if (s.plan.unit_lights) return s.recolour(lights);
  if (now.size() != s.plan.lights.size()) return false;
  bool turned = false, same_colour = true;
  glm::dvec3 ratio(-1.0);
  for (std::size_t l = 0; l < now.size(); ++l) {
    const DirectionalLight& planned = s.passes.light_maps.given[l];
    turned = turned || now[l].towards != planned.towards;
    for (int c = 0; c < 3; ++c) {
      const double before = planned.irradiance[c], after = now[l].irradiance[c];
      if (before == 0.0 && after == 0.0) continue;
      const double r = before > 0.0 ? after / before : -1.0;
      same_colour = same_colour && r >= 0.0 && r <= largest_ratio &&
                    (ratio[c] < 0.0 || std::abs(r - ratio[c]) <= 1e-12 * ratio[c]);
      ratio[c] = r;
    }
  }
  if (turned && s.settings.still) return false;
  if (same_colour && !turned) {
    for (int c = 0; c < 3; ++c) s.colour[c] = ratio[c] < 0.0 ? 1.0 : ratio[c];
    return true;
  }
  for (std::size_t l = 0; l < now.size(); ++l) s.passes.light_maps.given[l] = now[l];
  s.colour = glm::dvec3(1.0);
  s.relit = s.relit || turned;
  s.anew = true;
  return true;
}

void Renderer::positions_changed() { state_->moved = true; }

void Renderer::restart() { state_->anew = true; }

void Renderer::gather_into(std::size_t camera, const ImageTarget& target) {
  State& s = *state_;
  with_device_errors(s.compute.info(), [&] {
    // Before an estimate says which level shows least error, the likely one.
    cl_uint level = s.estimated_at == 0 ? s.likely_level() : s.level;
    level = s.plan.pyramids ? std::min(level, s.passes.layers.levels - 1) : 0;
    const float per_position = 1.0F / static_cast<float>(target.positions);
    const glm::vec3 gain(s.colour * static_cast<double>(target.gain));
    Gathering picture(camera, {level}, target.positions);
    picture.take = [&](const kernels::Window& w) {
      s.compute.launch("gather_image", pixels(w), Stage::gather, w, s.passes.film.sums,
                       kernels::float4{gain.x, gain.y, gain.z, 0.0F}, per_position, target.first, target.pitch,
                       target.buffer);
    };
    s.run({.picture = &picture});
  });
}

}  // namespace parian
