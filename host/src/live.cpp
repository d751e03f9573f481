// What an embedder may change between frames, and images that stay on the device: nothing here waits or reads back.
#include <algorithm>
#include <cmath>

#include "image_target.hpp"
#include "renderer_state.hpp"

namespace parian {
namespace {

constexpr double largest_ratio = 1e30;   // of light to what was summed: what is small in float32 has few digits
constexpr double longest_launch = 0.05;  // seconds, of launches that a frame is cut into

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

/// Layers for cameras that may go anywhere: all covered texels count as needed, and the device itself lists them.
void Renderer::State::plan_live_layers() {
  SurfaceSight sight;
  std::vector<kernels::View> views;
  if (device_mesh) {
    const std::vector<glm::dvec3> sphere = sphere_points();
    for (const glm::dvec3& d : even_directions(settings.layers)) {
      views.push_back(orthographic_view(sphere, d, settings.layer_size));
      views.back().number = static_cast<cl_uint>(views.size() - 1);
    }
  } else {
    views = placed_layers(sight);
  }
  make_layers(passes, views, plan.pyramids);
  statistics.layers_covered = device_mesh ? -1.0 : layer_coverage(passes, sight);
  allocate_points(passes, passes.layers.level_first[1]);
  list_covered(passes);
  find_centres(passes);
  const cl_uint listed = compute.read<cl_uint>(passes.layers.n_needed, 1)[0];
  count_layers(listed, listed);
}

/// How many points a launch may take, from how long a few take: no launch may look to a watchdog like a hang, and
/// cancelling should not take long.
void Renderer::State::measure_rate() {
  const std::size_t items = std::min<std::size_t>(accumulate_items(passes), 512);
  double seconds = 0.0;
  for (int i = 0; i < 2; ++i) {  // the first compiles
    seconds = 0.0;
    const Timer timer(seconds);
    try_accumulate(passes, items);
    compute.finish();
  }
  const double rate = static_cast<double>(items) / std::max(seconds, 1e-9);  // clocks may stand still for so few
  compute.limit("layers_accumulate", static_cast<std::size_t>(rate * longest_launch));
}

void Renderer::State::apply_changes() {
  if (!(moved || relit || anew)) return;
  if (moved) read_geometry(passes, *device_mesh);
  if (moved) passes.film.drawn.reset();
  for (std::size_t l = 0; l < plan.lights.size(); ++l) {
    kernels::Light& light = passes.light_maps.lights[l];
    const glm::dvec3 e = plan.summed_irradiance(l) / static_cast<double>(plan.lights[l].samples);
    light.irradiance = {static_cast<float>(e.x), static_cast<float>(e.y), static_cast<float>(e.z), 0.0F};
    if (relit) light.view = orthographic_view(sphere_points(), plan.lights[l].light.towards, passes.light_maps.size);
  }
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
    DirectionalLight& light = plan.lights[l].light;
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
    const DirectionalLight& planned = s.plan.lights[l].light;
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
  for (std::size_t l = 0; l < now.size(); ++l) s.plan.lights[l].light = now[l];
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
    colour_layers(s.passes);
    build_pyramids(s.passes, level);
    const float per_position = 1.0F / static_cast<float>(target.positions);
    const glm::vec3 gain(s.colour * static_cast<double>(target.gain));
    for (const kernels::Window& w : tiles(s.scene.film, s.plan.window)) {
      const std::size_t pixels = std::size_t{w.width} * w.height;
      s.compute.fill(s.passes.film.sums, 0, pixels * 8);
      s.compute.fill(s.passes.film.n_direct, 0, POSITIONS_SIDE_BY_SIDE + 1);
      s.gather_window(camera, w, {level}, target.positions);
      s.compute.launch("gather_image", pixels, Stage::gather, w, s.passes.film.sums,
                       kernels::float4{gain.x, gain.y, gain.z, 0.0F}, per_position, target.first, target.pitch,
                       target.buffer);
    }
  });
}

}  // namespace parian
