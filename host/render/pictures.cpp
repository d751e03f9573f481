// Pictures on the host: their halves, the level that shows least error, and the image itself.
#include <algorithm>
#include <cmath>
#include <optional>

#include "passes/raster.hpp"
#include "render/renderer_state.hpp"

namespace parian {

static constexpr std::uint32_t coarsest_level = 6;  // more blur than 64 texels shows nothing

/// One subpixel position tells a pixel's error where texels are as large as pixels; elsewhere about one per texel does.
std::uint32_t Renderer::State::positions_of_estimate(std::size_t camera) const {
  const double texels = texels_per_pixel(passes.layers, cameras[camera]);
  return static_cast<std::uint32_t>(std::clamp(std::ceil(texels * texels - 0.5), 1.0, 16.0));
}

LayerRange Renderer::State::layers_of(std::size_t camera) const {
  if (plan.gather == Gather::camera) return {static_cast<cl_uint>(camera), 1};
  return {0, passes.layers.count()};
}

/// Each level's texels average four of the one below: the finest whose texels have the samples of sixteen frames.
std::uint32_t Renderer::State::likely_level() const {
  std::uint32_t likely = 0;
  for (std::uint32_t frames = frame; frames < 16; frames *= 4) ++likely;
  return likely;
}

std::span<const Halves> Renderer::State::gather_halves(std::size_t camera, const std::vector<cl_uint>& levels,
                                                       std::uint32_t positions) {
  const std::size_t film = std::size_t{scene.film.x} * scene.film.y;
  halves.resize(std::max(halves.size(), levels.size()));
  for (Halves& h : halves) {
    h.a.resize(film);
    h.b.resize(film);
    h.alpha.resize(film);
  }
  std::uint64_t direct = 0;
  const glm::vec3 weight(colour / static_cast<double>(positions));
  Gathering picture(camera, levels, positions);
  picture.waits = true;
  picture.take = [&](const kernels::Window& w) {
    Timer timer(statistics.seconds.read);
    const std::size_t n = pixels(w);
    std::vector<kernels::float4>& sums = film_sums;
    sums.resize(n * 2 * levels.size());
    compute.read_into(sums, passes.film.sums);
    direct += compute.read<cl_uint>(passes.film.n_direct, 1, POSITIONS_SIDE_BY_SIDE)[0];
    unasked += settled(sums, n, positions);
    for (std::size_t set = 0; set < levels.size(); ++set)
      for (std::size_t i = 0; i < n; ++i) {
        const kernels::float4 a = sums[2 * (set * n + i)], b = sums[2 * (set * n + i) + 1];
        const std::size_t at = (w.y + i / w.width) * scene.film.x + w.x + i % w.width;
        halves[set].a[at] = glm::vec3(a.x, a.y, a.z) * weight;
        halves[set].b[at] = glm::vec3(b.x, b.y, b.z) * weight;
        halves[set].alpha[at] = a.w / static_cast<float>(positions);
      }
  };
  run({.picture = &picture});
  direct_evaluations += static_cast<double>(direct) * rounds_of(positions) * samples_per_frame() * plan.channels();
  fallback_pixels = (direct + positions - 1) / positions;
  return {halves.data(), levels.size()};
}

double Renderer::estimate() {
  State& s = *state_;
  return with_device_errors(s.compute.info(), [&] {
    s.look_outside();
    double best = INFINITY;
    const auto try_levels = [&](std::uint32_t highest, std::uint32_t lowest) {  // two of them, and level 0
      std::vector<cl_uint> levels;
      for (std::uint32_t level = highest; level >= std::max(lowest, 1U); --level) levels.push_back(level);
      levels.push_back(0);
      std::vector<double> worst(levels.size(), -1.0);
      for (std::size_t camera = 0; camera < s.cameras.size(); ++camera) {
        const std::span<const Halves> halves = s.gather_halves(camera, levels, s.positions_of_estimate(camera));
        for (std::size_t i = 0; i < halves.size(); ++i)
          worst[i] = std::max(worst[i], estimated_relmse(halves[i], halves.back(), s.expected(camera)));
      }
      for (std::size_t i = 0; i < levels.size(); ++i)
        if (worst[i] < best) {
          best = worst[i];
          s.level = levels[i];
        }
    };
    // The best level falls as the image converges. The first estimate starts at the likely one, and goes up as long as
    // that helps; later ones try the level shown and the next finer.
    const std::uint32_t coarsest = s.plan.pyramids ? std::min(s.passes.layers.levels - 1, coarsest_level) : 0;
    const bool first = s.estimated_at == 0;
    const std::uint32_t top = first ? std::min(s.likely_level(), coarsest) : s.level;
    s.estimated_at = s.frame;
    for (std::uint32_t level = top;; level -= 2) {
      try_levels(level, level - std::min(level, 1U));
      if (level <= 2) break;
    }
    for (std::uint32_t level = top, next; first && level < coarsest && s.level == level; level = next) {
      next = std::min(level + 2, coarsest);
      try_levels(next, level + 1);
    }
    s.statistics.estimated_relmse = best;
    return best;
  });
}

Image Renderer::image(std::size_t camera) {
  State& s = *state_;
  if (s.estimated_at == 0) estimate();  // which pyramid level to show
  std::optional<Timer> timer;
  if (camera > 0) timer.emplace(s.further_seconds);
  s.further_views += camera > 0;
  return with_device_errors(s.compute.info(), [&] {
    s.look_outside();
    std::vector<cl_uint> levels;
    if (s.level > 0) levels.push_back(s.level);
    levels.push_back(0);
    const std::span<const Halves> halves = s.gather_halves(camera, levels, subpixel_positions);
    // Checkpoints look at one position a pixel; over many of them level 0 may be the better one after all.
    const Expected expected = s.expected(camera);
    const double fine = estimated_relmse(halves.back(), halves.back(), expected);
    const double coarse = levels.size() > 1 ? estimated_relmse(halves.front(), halves.back(), expected) : fine;
    s.statistics.fallback_pixels = s.fallback_pixels + (camera == 0 ? 0 : s.statistics.fallback_pixels);
    const Halves& h = coarse < fine ? halves.front() : halves.back();
    if (s.plan.gather == Gather::camera) {
      const auto covered =
          static_cast<double>(std::count_if(h.alpha.begin(), h.alpha.end(), [](float a) { return a > 0; }));
      const double unseen = static_cast<double>(s.fallback_pixels) / std::max(covered, 1.0);
      s.statistics.layers_covered = std::min(s.statistics.layers_covered, 1.0 - unseen);
    }
    s.doubt_picture(camera, h);
    Image image{s.scene.film.x, s.scene.film.y, {}, std::min(coarse, fine), {}};
    s.statistics.estimated_bias_relmse = std::max(s.statistics.estimated_bias_relmse, s.bias_relmse(camera, h));
    s.statistics.estimated_relmse =
        camera == 0 ? image.estimated_relmse : std::max(s.statistics.estimated_relmse, image.estimated_relmse);
    image.rgba.reserve(h.alpha.size() * 4);
    for (std::size_t i = 0; i < h.alpha.size(); ++i) {
      for (int c = 0; c < 3; ++c) {
        float v = 0.5F * (h.a[i][c] + h.b[i][c]);
        if (!(std::isfinite(v) && v >= 0.0F)) {
          ++s.statistics.nonfinite;
          v = 0.0F;
        }
        image.rgba.push_back(v);
      }
      image.rgba.push_back(h.alpha[i]);
    }
    return image;
  });
}

}  // namespace parian
