// Batches of camera rays; at each point of exit S_d is summed over drawn places of entry.
#include "truth/reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>

#include "core/error.hpp"
#include "core/parallel.hpp"
#include "core/relative_error.hpp"
#include "kernels/bssrdf.h"
#include "plan/views.hpp"
#include "scene/limits.hpp"
#include "scene/medium.hpp"
#include "truth/reference_entry.hpp"
#include "truth/reference_surface.hpp"

namespace parian {
namespace {

constexpr std::uint32_t least_entries = 4;  // per light and point of exit
constexpr std::uint32_t pilot_rays = 256;   // that find out whether a pixel straddles an edge
constexpr std::uint32_t hasty_rays = 16;    // likewise, at least, where time is short
constexpr std::uint32_t at_edges = 8;       // times as many camera rays in pixels that do

kernels::real3 to_real3(glm::dvec3 v) { return {v.x, v.y, v.z}; }

struct Light {
  glm::dvec3 towards, irradiance;
};

/// The scene in object units, prepared for all batches.
class Transport {
 public:
  Transport(const Scene& scene, const ReferenceSettings& settings)
      : Transport(scene, settings, optics_of(scene.material)) {}

  Transport(const Scene& scene, const ReferenceSettings& settings, const Optics& optics)
      : model_(settings.model),
        space_(object_space(scene.mesh.positions)),
        view_(pinhole_view(scene.cameras.at(0), space_, scene.film)),
        boundary_(optics.boundary),
        surface_(scene.mesh, space_) {
    for (int c = 0; c < 3; ++c) {
      const kernels::ExactMedium medium =
          exact_medium(optics.channels[static_cast<std::size_t>(c)], model_, space_.radius);
      medium_of_[c] = no_medium;
      if (medium.scale == 0) continue;  // the channel is black
      // Channels with the same coefficients share one medium: the same doubles give the same constants.
      const auto same = [&](int other) {
        return scene.material.sigma_s[other] == scene.material.sigma_s[c] &&
               scene.material.sigma_a[other] == scene.material.sigma_a[c] &&
               scene.material.g[other] == scene.material.g[c];
      };
      medium_of_[c] = media_.size();
      for (int other = 0; other < c; ++other)
        if (same(other)) medium_of_[c] = medium_of_[other];
      if (medium_of_[c] == media_.size()) media_.push_back(medium);
    }
    std::vector<glm::dvec3> directions;
    for (const DirectionalLight& light : scene.lights) {
      if (light.irradiance == glm::dvec3(0)) continue;
      lights_.push_back({glm::normalize(light.towards), light.irradiance});
      directions.push_back(lights_.back().towards);
    }
    if (media_.empty() || lights_.empty()) return;
    entries_.emplace(surface_, media_, directions, settings.threads);
    entries_per_light_ = std::max(least_entries, settings.entries / static_cast<std::uint32_t>(lights_.size()));
  }

  /// One batch's RGBA of a pixel.
  [[nodiscard]] glm::dvec4 pixel(std::uint32_t x, std::uint32_t y, std::uint32_t samples, RandomStream& random) const {
    thread_local Scratch scratch;
    glm::dvec4 sum(0.0);
    const glm::dvec2 shift{random(), random()};
    for (std::uint32_t i = 0; i < samples; ++i) sum += sample(film_position(x, y, i, shift), scratch, random);
    return sum / double(samples);
  }

  /// Whether so many rays through a pixel find an edge of the object or a sudden step in depth or slope. Dark in front
  /// of bright differs a hundredfold: rays that miss a sliver of the bright side make the pixel too dark and its
  /// standard error too small.
  [[nodiscard]] bool straddles(std::uint32_t x, std::uint32_t y, std::uint32_t rays) const {
    const glm::dvec3 eye = exact(view_.origin), back = exact(view_.back);
    glm::dvec3 normal(0.0);
    double nearest = INFINITY, farthest = 0;
    std::uint32_t hits = 0;
    for (std::uint32_t i = 0; i < rays; ++i) {
      const CameraRay ray = camera_ray(film_position(x, y, i, glm::dvec2(0.5)));
      const auto place = surface_.first_hit(eye, ray.direction, ray.from);
      if (!place) continue;
      const SurfacePoint point = surface_.at(*place, -ray.direction);
      if (hits++ == 0) normal = point.n_g;
      if (glm::dot(point.n_g, normal) < 0.7) return true;
      const double depth = glm::dot(eye - point.x, back);
      nearest = std::min(nearest, depth);
      farthest = std::max(farthest, depth);
    }
    if (hits == 0) return false;
    return hits < rays || farthest - nearest > 4.0 * nearest / double{view_.scale};
  }

 private:
  static constexpr std::size_t no_medium = 3;
  struct Scratch {
    EntryCut cut;
    std::vector<EntryPlace> places;
  };

  struct CameraRay {
    glm::dvec3 direction;
    double from;  ///< distance of the near plane
  };

  [[nodiscard]] static glm::dvec3 exact(const kernels::float4& v) { return {v.x, v.y, v.z}; }

  /// Place `i` of the R2 sequence in a pixel, shifted.
  [[nodiscard]] static glm::dvec2 film_position(std::uint32_t x, std::uint32_t y, std::uint32_t i, glm::dvec2 shift) {
    return {x + std::fmod(shift.x + i * 0.7548776662466927, 1.0), y + std::fmod(shift.y + i * 0.5698402909980532, 1.0)};
  }

  [[nodiscard]] CameraRay camera_ray(glm::dvec2 film) const {
    const glm::dvec3 back = exact(view_.back);
    const glm::dvec3 direction = glm::normalize(
        ((film.x - view_.centre_x) * exact(view_.right) + (film.y - view_.centre_y) * exact(view_.down)) /
            double{view_.scale} -
        back);
    return {direction, view_.near_distance / -glm::dot(direction, back)};
  }

  /// RGBA of the surface seen at one place of the film.
  [[nodiscard]] glm::dvec4 sample(glm::dvec2 film, Scratch& scratch, RandomStream& random) const {
    const auto [direction, from] = camera_ray(film);
    const auto place = surface_.first_hit(exact(view_.origin), direction, from);
    if (!place) return glm::dvec4(0.0);
    const SurfacePoint exit = surface_.at(*place, -direction);
    const glm::dvec3 w_o = -direction;
    const kernels::real3 n = kernels::bend_normal(to_real3(exit.n_s), to_real3(w_o));
    const double T21 = kernels::fresnel_transmittance(kernels::real3_dot(n, to_real3(w_o)), boundary_);
    const glm::dvec3 radiance = T21 * scattered_radiance(exit.x, exit.n_s, scratch, random);
    if (!std::isfinite(radiance.x + radiance.y + radiance.z)) {
      throw Error(
          ErrorKind::input,
          fmt::format("triangle {}: the light that leaves it isn't finite; mend the mesh there", place->triangle));
    }
    return {radiance, 1.0};
  }

  [[nodiscard]] glm::dvec3 scattered_radiance(glm::dvec3 x_o, glm::dvec3 n_o, Scratch& scratch,
                                              RandomStream& random) const {
    glm::dvec3 radiance(0.0);
    if (!entries_) return radiance;
    entries_->cut(x_o, scratch.cut);
    for (std::size_t l = 0; l < lights_.size(); ++l) {
      const Light& light = lights_[l];
      entries_->draw(scratch.cut, l, entries_per_light_, random, scratch.places);
      std::array<double, 4> sum{};  // by medium; the last stays 0, for channels without one
      for (const EntryPlace& entry : scratch.places) {
        const SurfacePoint i = surface_.at(entry.place, light.towards);
        const double cosine = std::abs(glm::dot(i.n_g, light.towards));
        if (!surface_.is_lit(i.x, entry.place.triangle, light.towards)) continue;
        const kernels::real3 w_i = to_real3(light.towards), n_i = kernels::bend_normal(to_real3(i.n_s), w_i);
        const double T12 = kernels::fresnel_transmittance(kernels::real3_dot(n_i, w_i), boundary_);
        const kernels::DipoleGeometry geometry = kernels::dipole_geometry(
            to_real3(x_o - i.x), kernels::refract_into(w_i, n_i, boundary_), n_i, to_real3(n_o));
        const double factor = T12 * cosine / entry.density;
        for (std::size_t m = 0; m < media_.size(); ++m)
          sum[m] += factor * exact_bssrdf(model_, media_[m], boundary_, geometry);
      }
      radiance += light.irradiance * glm::dvec3(sum[medium_of_[0]], sum[medium_of_[1]], sum[medium_of_[2]]) /
                  double(entries_per_light_);
    }
    return radiance;
  }

  Model model_;
  ObjectSpace space_;
  kernels::View view_;
  kernels::ExactBoundary boundary_;
  std::vector<kernels::ExactMedium> media_;
  std::array<std::size_t, 3> medium_of_{};
  std::vector<Light> lights_;
  ReferenceSurface surface_;
  std::optional<ReferenceEntries> entries_;
  std::uint32_t entries_per_light_ = 0;
};

/// A film's pixels, rendered in parallel, and the wall seconds since the start.
class Film {
 public:
  Film(const Scene& scene, const ReferenceSettings& settings)
      : transport_(scene, settings),
        settings_(settings),
        width_(scene.film.x),
        samples_(std::size_t{scene.film.x} * scene.film.y),
        values_(samples_.size()) {}

  /// Whether `share` of the time there is, if it is limited, has passed.
  [[nodiscard]] bool passed(double share) const {
    return settings_.time > 0 &&
           std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count() >= share * settings_.time;
  }

  /// Chooses each pixel's camera rays in a batch. Where time is limited a quarter of it may go into a thorough search
  /// for edges, and a new state gets as many rays as let least_batches of them fit, up to `most`. Returns the rays of
  /// pixels that see no edge.
  std::uint32_t choose_samples(std::uint32_t most, bool fixed) {
    std::fill(samples_.begin(), samples_.end(), 1U);
    if (settings_.time > 0) find_edges(hasty_rays);
    find_edges(pilot_rays);
    if (settings_.time > 0 && !fixed) {
      constexpr std::size_t part = 64;  // of the film, for a first measure of a batch of single rays
      const auto before = std::chrono::steady_clock::now();
      in_parallel(values_.size() / part, settings_.threads, [&](std::size_t i) { render(part * i, 0); });
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
      const double fit = settings_.time / (std::max(seconds, 1e-9) * part * least_batches);
      most = fit < most ? std::max(1U, static_cast<std::uint32_t>(fit)) : most;
    }
    for (std::uint32_t& samples : samples_) samples *= most;
    return most;
  }

  /// Renders all pixels; false if the time there is ended it before.
  bool render_batch(std::uint32_t number, bool in_any_case) {
    constexpr std::size_t chunk = 32;  // pixels that a thread takes at once
    std::atomic<bool> whole{true};
    in_parallel((values_.size() + chunk - 1) / chunk, settings_.threads, [&](std::size_t k) {
      if (!in_any_case && (!whole || passed(1))) {
        whole = false;
        return;
      }
      for (std::size_t i = k * chunk; i < std::min(values_.size(), (k + 1) * chunk); ++i) render(i, number);
    });
    return whole;
  }
  [[nodiscard]] const std::vector<glm::dvec4>& values() const { return values_; }

 private:
  [[nodiscard]] std::uint32_t column(std::size_t i) const { return static_cast<std::uint32_t>(i % width_); }
  [[nodiscard]] std::uint32_t row(std::size_t i) const { return static_cast<std::uint32_t>(i / width_); }

  void find_edges(std::uint32_t rays) {
    in_parallel(samples_.size(), settings_.threads, [&](std::size_t i) {
      if (samples_[i] > 1 || (rays > hasty_rays && passed(0.25))) return;
      if (transport_.straddles(column(i), row(i), rays)) samples_[i] = at_edges;
    });
  }
  void render(std::size_t i, std::uint32_t batch) {
    RandomStream random(settings_.seed, batch, i);
    values_[i] = transport_.pixel(column(i), row(i), samples_[i], random);
  }

  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();  // before all else
  Transport transport_;
  const ReferenceSettings& settings_;
  std::uint32_t width_;
  std::vector<std::uint32_t> samples_;
  std::vector<glm::dvec4> values_;
};

/// Adds one batch to the running mean and sum of squares (Welford).
void add_batch(const std::vector<glm::dvec4>& batch, ReferenceState& state) {
  ++state.batches;
  const double n = state.batches;
  for (std::size_t i = 0; i < batch.size(); ++i)
    for (int c = 0; c < 4; ++c) {
      double& mean = state.mean[4 * i + c];
      const double before = batch[i][c] - mean;
      mean += before / n;
      if (c < 3) state.squared[3 * i + c] += before * (batch[i][c] - mean);
    }
}

}  // namespace

double own_relmse(const ReferenceState& state) {
  double sum = 0;
  std::vector<std::size_t> inside;
  for (std::size_t i = 0; i < state.mean.size() / 4; ++i) {
    if (static_cast<float>(state.mean[4 * i + 3]) < fully_covered) continue;
    inside.push_back(i);
    for (int c = 0; c < 3; ++c) sum += state.mean[4 * i + c];
  }
  if (inside.empty() || state.batches < 2) return -1;
  const double values = 3.0 * static_cast<double>(inside.size()), n = state.batches;
  const RelativeTo relative(sum, values);
  double relmse = 0;
  for (const std::size_t i : inside)
    for (int c = 0; c < 3; ++c) {
      const double mean = state.mean[4 * i + c], variance = state.squared[3 * i + c] / (n * (n - 1));
      if (variance > 0) relmse += variance / relative(mean) / values;
    }
  return relmse;
}

void render_reference(const Scene& scene, const ReferenceSettings& settings, ReferenceState& state,
                      const std::function<bool(std::uint32_t, double)>& progress) {
  validate(scene.material, "material");
  Film film(scene, settings);
  const std::size_t pixels = std::size_t{scene.film.x} * scene.film.y;
  const std::uint32_t samples =
      film.choose_samples(state.batches == 0 ? settings.samples : state.samples, state.batches > 0);
  if (state.batches == 0) {
    state = {scene.film.x,
             scene.film.y,
             0,
             samples,
             std::vector<double>(4 * pixels, 0.0),
             std::vector<double>(3 * pixels, 0.0)};
  }
  bool asked = false;  // to stop
  const auto done = [&] {
    if (state.batches < fewest_batches) return false;
    if (asked || film.passed(1)) return true;
    // The error is unknown where nothing is covered fully: then the least batches do.
    return state.batches >= least_batches && own_relmse(state) < settings.target;
  };
  while (!done()) {
    if (!film.render_batch(state.batches, state.batches < fewest_batches)) return;
    add_batch(film.values(), state);
    asked = progress && !progress(state.batches, own_relmse(state));
  }
}

Image reference_image(const ReferenceState& state) {
  Image image{
      state.width, state.height, std::vector<float>(state.mean.begin(), state.mean.end()), own_relmse(state), {}};
  if (state.batches < 2) return image;
  const double n = state.batches;
  for (const double squared : state.squared)
    image.standard_error.push_back(static_cast<float>(std::sqrt(squared / (n * (n - 1)))));
  return image;
}

ReferenceState reference_state(const Image& image, std::uint32_t batches, std::uint32_t samples) {
  const auto refuse = [](const std::string& what) {
    throw Error(ErrorKind::input, what + "; start a new one with another -o, or make this one again");
  };
  const std::size_t pixels = std::size_t{image.width} * image.height;
  if (image.standard_error.size() != 3 * pixels || image.rgba.size() != 4 * pixels)
    refuse("the picture doesn't say its standard error");
  if (batches < 2 || batches > most_batches) refuse(fmt::format("no picture is of {} batches", batches));
  if (samples < 1 || samples > most_samples) refuse(fmt::format("no batch is of {} camera rays per pixel", samples));
  for (const float value : image.rgba)
    if (!std::isfinite(value)) refuse("a value of the picture isn't finite");
  for (std::size_t i = 3; i < image.rgba.size(); i += 4)
    if (!(image.rgba[i] >= 0.0F && image.rgba[i] <= 1.0F)) refuse("a pixel's alpha isn't between 0 and 1");
  for (const float error : image.standard_error)
    if (!(error >= 0.0F && std::isfinite(error))) refuse("a standard error is negative or isn't finite");
  ReferenceState state{image.width, image.height, batches, samples, {image.rgba.begin(), image.rgba.end()}, {}};
  for (const double error : image.standard_error) state.squared.push_back(error * error * batches * (batches - 1.0));
  return state;
}

std::string fingerprint(const Scene& scene, Model model) {
  std::uint64_t hash = 0xcbf29ce484222325;  // FNV-1a, 64 bits
  const auto add = [&hash](const void* bytes, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) hash = (hash ^ static_cast<const unsigned char*>(bytes)[i]) * 0x100000001b3;
  };
  const auto add_all = [&](const auto& values) { add(values.data(), values.size() * sizeof(values[0])); };
  const auto add_one = [&](const auto& value) { add(&value, sizeof value); };
  add_all(scene.mesh.positions);
  add_all(scene.mesh.triangles);
  add_all(scene.mesh.normals);
  for (const glm::dvec3& v : {scene.material.sigma_s, scene.material.sigma_a, scene.material.g}) add_one(v);
  add_one(scene.material.ior);
  for (const DirectionalLight& light : scene.lights) {
    add_one(light.towards);
    add_one(light.irradiance);
  }
  const Camera& camera = scene.cameras.at(0);
  for (const glm::dvec3& v : {camera.eye, camera.target, camera.up}) add_one(v);
  add_one(camera.fov);
  add_one(scene.film);
  add_one(model);
  return fmt::format("{:016x}", hash);
}

}  // namespace parian
