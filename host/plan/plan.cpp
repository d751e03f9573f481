// The first half of the plan: from the scene alone. The second half, from visibility, is made by the renderer.
#include "plan/plan.hpp"

#include <CL/cl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.hpp"
#include "core/words.hpp"
#include "scene/limits.hpp"
#include "scene/medium.hpp"

namespace parian {
namespace {

/// Distinct scattering channels in an order that doesn't depend on which colour has them.
void plan_media(Plan& plan, const Scene& scene, const Optics& optics, const Settings& settings) {
  const Material& m = scene.material;
  struct Channel {
    std::uint32_t colour;
    std::array<double, 3> key;  // sigma_s, sigma_a, g
    kernels::Medium medium;
  };
  std::vector<Channel> channels;
  bool scatters = false;
  for (std::uint32_t c = 0; c < 3; ++c) {
    const ChannelConstants& constants = optics.channels[c];
    plan.medium_of[c] = 3;
    scatters = scatters || constants.alpha_prime > 0.0;
    if (!(constants.alpha_prime > 0.0) && !kept(settings, "black-channels")) {
      plan.left_out.push_back({"black-channels", fmt::format("channel {} does not scatter", "RGB"[c]), "evaluations"});
      continue;
    }
    channels.push_back(
        {c, {m.sigma_s[c], m.sigma_a[c], m.g[c]}, device_medium(constants, settings.model, plan.space.radius)});
  }
  std::stable_sort(channels.begin(), channels.end(), [](const auto& a, const auto& b) { return a.key < b.key; });
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const bool same = i > 0 && channels[i].key == channels[i - 1].key && !kept(settings, "equal-channels");
    if (same)
      plan.left_out.push_back({"equal-channels",
                               fmt::format("channel {} has the coefficients of channel {}", "RGB"[channels[i].colour],
                                           "RGB"[channels[i - 1].colour]),
                               "evaluations"});
    else
      plan.media.push_back(channels[i].medium);
    plan.medium_of[channels[i].colour] = static_cast<std::uint32_t>(plan.media.size() - 1);
  }
  for (auto& medium : plan.medium_of)
    medium = std::min<std::uint32_t>(medium, static_cast<std::uint32_t>(plan.media.size()));
  if (plan.media.empty()) {
    plan.media.push_back(device_medium(channel_constants(0.0, 1.0, 0.0, m.ior), settings.model, plan.space.radius));
    plan.medium_of = {1, 1, 1};
  }
  if (!scatters)
    plan.warnings.push_back(fmt::format("material '{}' does not scatter at all: the image is black", m.name));
}

void warn_of_scale(Plan& plan, const Optics& optics) {
  double longest = 0.0, shortest = INFINITY;
  for (const ChannelConstants& k : optics.channels) {
    if (!(k.alpha_prime > 0.0)) continue;
    longest = std::max(longest, 1.0 / k.sigma_t_prime);
    shortest = std::min(shortest, 1.0 / k.sigma_t_prime);
  }
  const double diameter = 2.0 * plan.space.radius;
  if (longest > 0.25 * diameter)
    plan.warnings.push_back(
        fmt::format("mean free path of {:.3g} mm is long for an object of {:.3g} mm: light crosses it nearly "
                    "unscattered, which a diffusion model can't show; use a larger size or a denser material",
                    longest, diameter));
  if (shortest < 1e-3 * diameter)
    plan.warnings.push_back(
        fmt::format("mean free path of {:.3g} mm is short for an object of {:.3g} mm: it looks nearly opaque, and "
                    "samples of a light map miss most of its light, so that the picture is too dark without the "
                    "estimate knowing; use a larger {}, a smaller size or a thinner material",
                    shortest, diameter, setting("light_map_size")));
}

/// Whether a light's rays run along all of the surface, and so enter nowhere: a flat object, seen edge-on.
bool grazes(const Mesh& mesh, glm::dvec3 towards) {
  return std::none_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const glm::uvec3& t) {
    const glm::dvec3 a = mesh.positions[t.x], n = glm::cross(mesh.positions[t.y] - a, mesh.positions[t.z] - a);
    return std::abs(glm::dot(n, towards)) > 1e-9 * glm::length(n) * glm::length(towards);
  });
}

/// Lights that can matter, with the half's samples divided by flux, largest remainders first, at least one each.
void plan_lights(Plan& plan, const Scene& scene, const Settings& settings) {
  std::vector<double> flux;
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    const DirectionalLight& light = scene.lights[i];
    const double e = light.irradiance.x + light.irradiance.y + light.irradiance.z;
    const bool grazing = settings.still && !scene.on_device && grazes(scene.mesh, light.towards);
    if ((!(e > 0.0) || grazing) && !kept(settings, "dark-lights")) {
      const char* why = e > 0.0 ? "runs along all of the surface" : "has no irradiance";
      plan.left_out.push_back({"dark-lights", fmt::format("light {} {}: no maps of it", i + 1, why), "bytes",
                               static_cast<double>(settings.light_map_size) * settings.light_map_size * (2 * 16 + 8)});
      continue;
    }
    plan.lights.push_back({light, static_cast<std::uint32_t>(i), 1});
    flux.push_back(std::max(e, 0.0));
  }
  plan.dark = plan.lights.empty();
  if (plan.dark) {
    plan.warnings.push_back("no light reaches the object: the image is black");
    plan.lights.push_back({{glm::dvec3(0, 0, 1), glm::dvec3(0.0)}, 0, 1});
    flux.push_back(1.0);
  }
  const double total = std::max(std::accumulate(flux.begin(), flux.end(), 0.0), 1e-300);
  const std::uint32_t half =
      std::max<std::uint32_t>(settings.samples / 2, static_cast<std::uint32_t>(plan.lights.size()));
  std::uint32_t given = 0;
  std::vector<std::pair<double, std::size_t>> remainders;
  for (std::size_t i = 0; i < flux.size(); ++i) {
    const double share = flux[i] / total * half;
    plan.lights[i].samples = std::max<std::uint32_t>(1, static_cast<std::uint32_t>(share));
    if (!(flux[i] > 0.0)) continue;  // the others share as if it weren't there
    given += plan.lights[i].samples;
    remainders.emplace_back(static_cast<double>(plan.lights[i].samples) - share, i);
  }
  std::sort(remainders.begin(), remainders.end());
  for (std::size_t i = 0; given < half && !remainders.empty(); ++i, ++given)
    ++plan.lights[remainders[i % remainders.size()].second].samples;
}

std::size_t n_positions(const Scene& scene) {
  return scene.on_device ? scene.on_device->positions : scene.mesh.positions.size();
}
std::size_t n_triangles(const Scene& scene) {
  return scene.on_device ? scene.on_device->triangles : scene.mesh.triangles.size();
}

[[noreturn]] void fail(const std::string& what) { throw Error(ErrorKind::input, what); }

bool finite(glm::dvec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// Refuses what no picture can be made of; a scene file's reader says where, an embedder has only this.
void check_scene(const Scene& scene) {
  if (scene.on_device) check_bounds(*scene.on_device);
  if (n_triangles(scene) == 0) fail("mesh: no triangle has an area; give one that has");
  for (std::size_t i = 0; i < scene.mesh.positions.size(); ++i)
    if (!finite(scene.mesh.positions[i])) fail(fmt::format("mesh: vertex {} is not finite; leave it out", i));
  check_cameras(scene.cameras, scene.film);
  check_lights(scene.lights);
}

/// The layers that are to be made: how many, and their film.
std::pair<std::uint64_t, glm::uvec2> planned_layers(const Plan& plan, const Scene& scene, const Settings& settings) {
  if (plan.gather == Gather::layers) return {settings.layers, glm::uvec2(settings.layer_size)};
  kernels::View view{};
  view.width = scene.film.x;
  view.height = scene.film.y;
  view = camera_layer(view);
  return {scene.cameras.size(), {view.width, view.height}};
}

/// The cameras' own views are layers like any others, and need no others while they have neither larger texels nor more
/// of them.
void plan_gather(Plan& plan, const Scene& scene, const Settings& settings) {
  plan.gather = settings.gather;
  if (settings.gather != Gather::automatic) return;
  plan.gather = settings.still ? Gather::camera : Gather::layers;
  if (!settings.still) return;
  const auto [count, film] = planned_layers(plan, scene, settings);
  const std::uint64_t texels = std::uint64_t{settings.layer_size} * settings.layer_size * settings.layers;
  const bool coarser = std::min(film.x, film.y) < settings.layer_size;
  if (kept(settings, "layers") || coarser || count * film.x * film.y > texels)
    plan.gather = Gather::layers;
  else
    plan.left_out.push_back({"layers", "the cameras' own views are all the layers that they need", "layers",
                             settings.layers - static_cast<double>(count), false});
}

void plan_memory(Plan& plan, const Scene& scene, const Settings& settings, const DeviceInfo& device) {
  const auto [layers, film] = planned_layers(plan, scene, settings);
  const std::uint64_t positions = n_positions(scene), triangles = n_triangles(scene), texels = layers * film.x * film.y;
  const std::uint64_t map = std::uint64_t{settings.light_map_size} * settings.light_map_size;
  std::uint64_t all_levels = texels;
  for (glm::uvec2 size = film; plan.pyramids && size != glm::uvec2(1);) {
    size = (size + 1U) / 2U;
    all_levels += size.x * size.y * layers;
  }
  const std::uint64_t records = triangles * plan.records * sizeof(kernels::RasterTriangle);
  const std::uint64_t maps = plan.lights.size() * 2 * map * 16;
  const std::uint64_t values = all_levels * 32, sums = plan.sums() > 1 ? texels * 32 * plan.sums() : 0;
  const std::uint64_t guides = plan.guides ? guide_bytes(plan.lights.size(), layers * guide_tiles(film), map) : 0;
  const std::uint64_t sight = plan.gather == Gather::layers && !scene.on_device ? sight_bytes(settings.layers) : 0;
  const std::uint64_t live = (settings.still ? 0 : texels * 4) + (scene.on_device ? positions * 12 : 0);
  const std::uint64_t bytes = live + positions * 16 + triangles * (12 + 36) + records + triangles * plan.records * 4 +
                              maps + plan.lights.size() * map * 11 + map * 8 + guides + texels * 12 + all_levels * 20 +
                              values + sums + texels * (32 + 16 * plan.lights.size()) + sight +
                              (std::uint64_t{4} << 20);
  const std::uint64_t largest =
      std::max({records, maps, values, sums, guides, texels * 32, texels * 16 * plan.lights.size(), sight});
  const auto too_large = [&] {
    return plan.bytes > device.global_memory / 10 * 9 || plan.largest > device.max_allocation;
  };
  // Where memory is short, the film is gathered in smaller windows.
  for (plan.window = window_limit; plan.window >= smallest_window; plan.window /= 2) {
    const std::uint64_t pixels =
        std::uint64_t{std::min(scene.film.x, plan.window)} * std::min(scene.film.y, plan.window);
    const std::uint64_t film_sums = pixels * 32 * (plan.pyramids ? 3 : 1);
    plan.largest = std::max(largest, film_sums);
    plan.bytes = bytes + std::min<std::uint64_t>(pixels, direct_points) * (64 + 16 * plan.lights.size()) + film_sums +
                 pixels * (8 + 12 * POSITIONS_SIDE_BY_SIDE);
    if (!too_large()) break;
  }
  plan.window = std::max(plan.window, smallest_window);
  const auto mib = [](std::uint64_t b) { return static_cast<double>(b) / 1048576.0; };
  constexpr std::uint64_t index_limit = std::uint64_t{1} << 30;  // texels and triangles are numbered in 32 bits
  const bool too_many = all_levels > index_limit || plan.lights.size() * 2 * map > index_limit ||
                        triangles * plan.records > index_limit / 4;
  if (plan.guides && (guides > most_guides || too_large())) {
    plan.guides = false;
    return plan_memory(plan, scene, settings, device);
  }
  if ((too_many || too_large() || texels * plan.sums() > index_limit) && plan.sums() > 1) {
    plan.unit_lights = false;
    return plan_memory(plan, scene, settings, device);
  }
  if (too_many || (too_large() && !settings.force))
    throw Error(
        ErrorKind::device,
        fmt::format("{}: the scene needs up to {:.0f} MiB, {:.0f} MiB in one buffer, but the device has {:.0f} MiB and "
                    "allows {:.0f} MiB per buffer; lower {}, {} or {}",
                    device.name, mib(plan.bytes), mib(plan.largest), mib(device.global_memory),
                    mib(device.max_allocation), setting("layer_size"), setting("layers"), setting("light_map_size")),
        CL_MEM_OBJECT_ALLOCATION_FAILURE);
}

}  // namespace

bool kept(const Settings& settings, const std::string& name) {
  return settings.keep.contains(name) || settings.keep.contains("all");
}

std::uint64_t sight_bytes(std::uint32_t layers) {
  const std::uint64_t candidates = candidate_directions + 2 * std::uint64_t{layers};
  return surface_samples * (2 * sizeof(kernels::float4) + candidates * sizeof(float)) +
         std::uint64_t{candidate_size} * candidate_size * 2 * sizeof(cl_uint);
}

std::uint64_t guide_bytes(std::uint64_t lights, std::uint64_t tiles, std::uint64_t texels) {
  return lights * (tiles * (16 + 8 * GUIDE_SIZE) + 8 * (1 + 2 * texels)) + 8 * GUIDE_CUBES +
         32 * GUIDE_RANGES * (1 + PARTS_OF_RANGE);
}

std::uint32_t guide_tiles(glm::uvec2 film) {
  const glm::uvec2 tiles = (film + (GUIDE_TILE - 1)) / GUIDE_TILE;
  return tiles.x * tiles.y;
}

std::vector<std::uint32_t> mip_offsets(glm::uvec2 film, std::uint32_t count) {
  std::vector<std::uint32_t> first{0};
  for (;;) {
    first.push_back(first.back() + film.x * film.y * count);
    if (film == glm::uvec2(1)) return first;
    film = (film + 1U) / 2U;
  }
}

Plan make_plan(const Scene& scene, const Settings& settings, const DeviceInfo& device) {
  check_kept(settings);
  check_scene(scene);
  check_samples(settings);
  Plan plan;
  plan.space = scene.on_device
                   ? ObjectSpace{scene.on_device->centre, scene.on_device->radius > 0.0 ? scene.on_device->radius : 1.0}
                   : object_space(scene.mesh.positions);
  plan.warnings = scene.mesh.warnings;
  validate(scene.material, "material '" + scene.material.name + "'");
  const Optics optics = optics_of(scene.material);
  plan_media(plan, scene, optics, settings);
  for (const std::string& doubt : doubts_of(scene.material, optics)) plan.warnings.push_back(doubt);
  warn_of_scale(plan, optics);
  plan.boundary = device_boundary(optics.boundary);
  plan.density = density_table(plan.media, settings.disc_radius / plan.space.radius);
  plan_lights(plan, scene, settings);
  plan.unit_lights = !settings.still && plan.lights.size() <= most_sums;

  plan.clipping = kept(settings, "clipping") || !settings.still;  // who knows where a camera will go
  for (const Camera& camera : scene.cameras)
    if (needs_clipping(pinhole_view(camera, plan.space, scene.film))) plan.clipping = true;
  plan.records = plan.clipping ? 6 : 1;
  if (!plan.clipping)
    plan.left_out.push_back({"clipping", "the object lies inside every camera's near plane and guard band", "bytes",
                             static_cast<double>(n_triangles(scene) * 5 * sizeof(kernels::RasterTriangle)), false});
  plan_gather(plan, scene, settings);
  plan.guides = settings.estimator == Estimator::automatic;
  plan.height_pyramids = settings.estimator == Estimator::automatic || kept(settings, "height-pyramids");
  if (!plan.height_pyramids)
    plan.left_out.push_back(
        {"height-pyramids", "this estimator looks for no nearest lit place", "bytes",
         static_cast<double>((mip_offsets(glm::uvec2(settings.light_map_size), 1).back() * plan.lights.size() - 1) *
                             sizeof(cl_float2))});
  plan.pyramids = settings.pyramids && planned_layers(plan, scene, settings).second != glm::uvec2(1);

  plan.lanes = device.vector_width;
  std::uint32_t most = 0;
  for (const auto& light : plan.lights) most = std::max(most, light.samples);
  while (plan.lanes > 4 && plan.lanes >= 4 * most) plan.lanes /= 2;  // no wider than both halves of the brightest light
  const int estimator = settings.estimator == Estimator::radial ? 1 : settings.estimator == Estimator::disc ? 2 : 0;
  plan.options = fmt::format(
      "-cl-std=CL1.2 -DVW={} -DMODEL={} -DESTIMATOR={} -DMEDIA={} -DMEDIUM_R={} -DMEDIUM_G={} "
      "-DMEDIUM_B={} -DRECORDS={}",
      plan.lanes, static_cast<int>(settings.model), estimator, plan.media.size(), plan.medium_of[0], plan.medium_of[1],
      plan.medium_of[2], plan.records);
  plan_memory(plan, scene, settings, device);
  return plan;
}

}  // namespace parian
