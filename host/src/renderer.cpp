// One scene on one device: the second half of the plan, then frames. The algorithm is four calls: draw_light_maps,
// accumulate_layers, build_pyramids, gather.
#include "renderer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "estimate.hpp"
#include "passes.hpp"

namespace parian {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::uint32_t subpixel_positions = 64;    // of an image that is written
constexpr std::uint32_t redraw_samples = 64;        // per texel and half between two shifts of the light map
constexpr std::uint32_t candidate_directions = 64;  // for the layers, beside the evenly spread ones
constexpr std::uint32_t candidate_size = 256;       // of their films
constexpr std::size_t surface_samples = 16384;      // points on which the choice rests
constexpr std::uint32_t mark_positions = 8;         // subpixel positions whose texels are needed
constexpr std::uint32_t coarsest_level = 6;         // more blur than 64 texels shows nothing

/// Adds the wall time of its own life to a counter.
class Timer {
 public:
  explicit Timer(double& seconds) : seconds_(seconds), start_(Clock::now()) {}
  ~Timer() { seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

 private:
  double& seconds_;
  Clock::time_point start_;
};

/// Tiles of a film, each small enough to be gathered at once.
std::vector<kernels::Window> tiles(glm::uvec2 film) {
  std::vector<kernels::Window> all;
  for (std::uint32_t y = 0; y < film.y; y += window_limit)
    for (std::uint32_t x = 0; x < film.x; x += window_limit) {
      kernels::Window w{};
      w.x = x;
      w.y = y;
      w.width = std::min(window_limit, film.x - x);
      w.height = std::min(window_limit, film.y - y);
      w.sample_x = w.sample_y = 128;
      all.push_back(w);
    }
  return all;
}

}  // namespace

struct Renderer::State {
  State(const Scene& s, const Settings& set, const std::string& selector)
      : scene(s), settings(set), compute(selector), plan(make_plan(s, set, compute.info())), passes(compute, plan) {}

  Scene scene;
  Settings settings;
  Compute compute;
  Plan plan;
  Passes passes;
  std::vector<kernels::View> cameras;
  std::vector<glm::dvec3> points;  // the mesh's positions in object units
  Statistics statistics;
  std::uint32_t frame = 0, epoch = 0;
  std::uint32_t level = 0;  // of the pyramids, as shown by the last estimate
  bool first_estimate = true;

  void prepare();
  std::vector<kernels::View> choose_layers();
  void measure_coverage();
  void find_needed();
  void allocate_film();
  std::vector<Halves> gather_halves(std::size_t camera, const std::vector<cl_uint>& levels, std::uint32_t positions);
  std::vector<kernels::float4> sample_points;
  std::vector<bool> outside;
};

void Renderer::State::prepare() {
  {
    Timer timer(statistics.seconds.compile);
    compute.build(plan.options);
  }
  with_device_errors(compute.info(), [&] {
    Timer timer(statistics.seconds.plan);
    passes.seed = settings.seed;
    for (const glm::dvec3& x : scene.mesh.positions) points.push_back((x - plan.space.centre) / plan.space.radius);
    for (const Camera& camera : scene.cameras) cameras.push_back(pinhole_view(camera, plan.space, scene.film));
    upload_geometry(passes, scene.mesh);
    passes.media = compute.upload(plan.media);
    passes.rho = compute.upload(plan.density.rho);
    allocate_film();
    make_layers(passes, choose_layers(), settings.layer_size, plan.pyramids);
    measure_coverage();
    make_light_maps(passes, points, settings.light_map_size);
    draw_light_maps(passes, 0, settings.light_map_shift);
    find_needed();
    compute.finish();
  });
  statistics.warnings = plan.warnings;
}

void Renderer::State::allocate_film() {
  Film& f = passes.film;
  const std::size_t pixels = std::size_t{std::min(scene.film.x, window_limit)} * std::min(scene.film.y, window_limit);
  f.depth = compute.buffer<cl_uint>(std::max<std::size_t>(pixels, candidate_size * candidate_size));
  f.ids = compute.buffer<cl_uint>(pixels);
  f.direct = compute.buffer<cl_uint>(pixels);
  f.n_direct = compute.buffer<cl_uint>(1);
  f.sums = compute.buffer<kernels::float4>(pixels * 2 * (plan.pyramids ? 3 : 1));
}

std::vector<kernels::View> Renderer::State::choose_layers() {
  const SurfacePoints surface = surface_points(points, scene.mesh.triangles, surface_samples);
  for (std::size_t i = 0; i < surface.x.size(); ++i) {
    const glm::vec3 x(surface.x[i]), n(surface.n[i]);
    sample_points.push_back({x.x, x.y, x.z, 0.0F});
    sample_points.push_back({n.x, n.y, n.z, 0.0F});
  }
  const cl::Buffer samples = compute.upload(sample_points);
  const cl::Buffer quality = compute.buffer<float>(surface_samples);
  std::vector<glm::dvec3> directions = even_directions(settings.layers);
  for (const glm::dvec3& d : even_directions(candidate_directions)) directions.push_back(d);
  std::vector<std::vector<float>> seen;
  for (const glm::dvec3& d : directions) {
    const kernels::View view = orthographic_view(points, d, candidate_size);
    kernels::Window window{};
    window.width = window.height = candidate_size;
    window.sample_x = window.sample_y = 128;
    setup_view(passes, view, Stage::plan);
    draw(passes, window, passes.film.depth, nullptr, Stage::plan);
    compute.launch("layers_visibility", surface_samples, Stage::plan, view, passes.film.depth,
                   static_cast<cl_uint>(surface_samples), samples, quality);
    seen.push_back(compute.read<float>(quality, surface_samples));
  }
  outside.assign(surface_samples, false);
  for (const auto& candidate : seen)
    for (std::size_t i = 0; i < surface_samples; ++i) outside[i] = outside[i] || candidate[i] > 0.1F;

  // Never worse than evenly spread directions: those stand if they see more.
  const auto covered = [&](const std::vector<std::size_t>& chosen) {
    std::size_t n = 0;
    for (std::size_t i = 0; i < surface_samples; ++i)
      n += std::any_of(chosen.begin(), chosen.end(), [&](std::size_t c) { return seen[c][i] > 0.1F; });
    return n;
  };
  std::vector<std::size_t> even(settings.layers);
  for (std::size_t i = 0; i < even.size(); ++i) even[i] = i;
  const std::vector<std::size_t> greedy = choose_directions(seen, settings.layers);
  const std::vector<std::size_t>& chosen = covered(greedy) >= covered(even) ? greedy : even;
  std::vector<kernels::View> views;
  for (const std::size_t c : chosen) views.push_back(orthographic_view(points, directions[c], settings.layer_size));
  return views;
}

void Renderer::State::measure_coverage() {
  const Layers& k = passes.layers;
  const cl::Buffer samples = compute.upload(sample_points);
  const cl::Buffer weights = compute.buffer<float>(surface_samples);
  compute.launch("gather_weight", surface_samples, Stage::plan, static_cast<cl_uint>(surface_samples), samples,
                 k.views_buffer, k.level_first_buffer, k.geometry, k.slots, k.count(), k.size, weights);
  const std::vector<float> weight = compute.read<float>(weights, surface_samples);
  std::size_t visible = 0, covered = 0;
  for (std::size_t i = 0; i < surface_samples; ++i) {
    visible += outside[i];
    covered += outside[i] && weight[i] >= 1e-3F;
  }
  statistics.layers_covered = visible ? static_cast<double>(covered) / static_cast<double>(visible) : 0.0;
}

void Renderer::State::find_needed() {
  Layers& k = passes.layers;
  const std::size_t texels = k.level_first[1];
  std::vector<cl_uint> marks = compute.read<cl_uint>(k.slots, texels);
  std::vector<cl_uint> needed;
  for (std::size_t t = 0; t < texels; ++t) k.covered_texels += marks[t] != 0xffffffffU;
  const bool all = kept(settings, "unread-texels");
  if (!all) {
    cl::Buffer buffer = compute.buffer<cl_uint>(texels);
    compute.fill(buffer, 0, texels);
    for (const kernels::View& view : cameras) {
      setup_view(passes, view, Stage::plan);
      for (kernels::Window w : tiles(scene.film))
        for (std::uint32_t i = 0; i < mark_positions; ++i) {
          const glm::ivec2 s = subpixel_position(i, 0);
          w.sample_x = s.x;
          w.sample_y = s.y;
          mark_needed(passes, view, w, buffer);
        }
    }
    marks = compute.read<cl_uint>(buffer, texels);
    compute.release(buffer);
  }
  for (std::size_t t = 0; t < texels; ++t)
    if (all ? marks[t] != 0xffffffffU : marks[t] != 0) needed.push_back(static_cast<cl_uint>(t));
  set_needed(passes, needed);
  statistics.layers_count = k.count();
  statistics.layers_size = k.size;
  statistics.layers_texels = k.covered_texels;
  statistics.layers_texels_evaluated = needed.size();
}

Renderer::Renderer(const Scene& scene, const Settings& settings, const std::string& selector)
    : state_(std::make_unique<State>(scene, settings, selector)) {
  state_->prepare();
}

Renderer::~Renderer() = default;

std::vector<std::string> Renderer::explanation() const { return {}; }

void Renderer::frame() {
  State& s = *state_;
  with_device_errors(s.compute.info(), [&] {
    std::uint32_t most = 0;
    for (const auto& light : s.plan.lights) most = std::max(most, light.samples);
    const std::uint32_t epoch = s.settings.light_map_shift ? s.frame * most / redraw_samples : 0;
    if (epoch != s.epoch) {
      Timer timer(s.statistics.seconds.light_map);
      s.epoch = epoch;
      draw_light_maps(s.passes, epoch, true);
      s.compute.finish();
    }
    Timer timer(s.statistics.seconds.layers);
    accumulate_layers(s.passes, s.frame);
    s.compute.finish();
    ++s.frame;
  });
}

std::uint32_t Renderer::frames() const { return state_->frame; }

bool Renderer::checkpoint() const {
  std::uint32_t n = state_->frame;
  while (n > 4 && n % 2 == 0) n /= 2;
  return n >= 1 && n <= 4;
}

std::vector<Halves> Renderer::State::gather_halves(std::size_t camera, const std::vector<cl_uint>& levels,
                                                   std::uint32_t positions) {
  const kernels::View& view = cameras[camera];
  const std::size_t all = std::size_t{scene.film.x} * scene.film.y;
  std::vector<Halves> halves(levels.size());
  for (Halves& h : halves) {
    h.a.resize(all);
    h.b.resize(all);
    h.alpha.resize(all);
  }
  if (*std::max_element(levels.begin(), levels.end()) > 0) {
    Timer timer(statistics.seconds.pyramids);
    build_pyramids(passes, *std::max_element(levels.begin(), levels.end()));
    compute.finish();
  }
  std::uint64_t direct = 0;
  {
    Timer timer(statistics.seconds.gather);
    setup_view(passes, view, Stage::gather);
  }
  const std::uint32_t rounds = (frame + positions - 1) / positions;
  for (kernels::Window w : tiles(scene.film)) {
    const std::size_t pixels = std::size_t{w.width} * w.height;
    {
      Timer timer(statistics.seconds.gather);
      compute.fill(passes.film.sums, 0, pixels * 8 * levels.size());
      for (std::uint32_t i = 0; i < positions; ++i) {
        const glm::ivec2 s = subpixel_position(i, 0);
        w.sample_x = s.x;
        w.sample_y = s.y;
        gather(passes, view, w, levels, 1.0F / static_cast<float>(frame), i * rounds, rounds);
        if (positions > 1) direct += compute.read<cl_uint>(passes.film.n_direct, 1)[0];
      }
      compute.finish();
    }
    Timer timer(statistics.seconds.read);
    const std::vector<kernels::float4> sums =
        compute.read<kernels::float4>(passes.film.sums, pixels * 2 * levels.size());
    const float weight = 1.0F / static_cast<float>(positions);
    for (std::size_t set = 0; set < levels.size(); ++set)
      for (std::size_t i = 0; i < pixels; ++i) {
        const kernels::float4 a = sums[2 * (set * pixels + i)], b = sums[2 * (set * pixels + i) + 1];
        const std::size_t at = (w.y + i / w.width) * scene.film.x + w.x + i % w.width;
        halves[set].a[at] = glm::vec3(a.x, a.y, a.z) * weight;
        halves[set].b[at] = glm::vec3(b.x, b.y, b.z) * weight;
        halves[set].alpha[at] = a.w * weight;
      }
  }
  if (positions > 1) statistics.fallback_pixels = (direct + positions - 1) / positions;
  for (Halves& h : halves) {
    h.a0 = halves.back().a;
    h.b0 = halves.back().b;
  }
  return halves;
}

double Renderer::estimate() {
  State& s = *state_;
  return with_device_errors(s.compute.info(), [&] {
    std::vector<cl_uint> levels;
    if (s.plan.pyramids && s.first_estimate) s.level = std::min(s.passes.layers.levels - 1, coarsest_level);
    s.first_estimate = false;
    double shown = INFINITY;
    // Down while it gets better: the level falls as the image converges, and never rises again.
    for (;;) {
      levels.clear();
      if (s.level > 0) levels.push_back(s.level);
      if (s.level > 1) levels.push_back(s.level - 1);
      levels.push_back(0);
      std::vector<double> worst(levels.size(), 0.0);
      for (std::size_t camera = 0; camera < s.cameras.size(); ++camera) {
        const std::vector<Halves> halves = s.gather_halves(camera, levels, 1);
        for (std::size_t i = 0; i < halves.size(); ++i) worst[i] = std::max(worst[i], estimated_relmse(halves[i]));
      }
      const std::size_t best = static_cast<std::size_t>(std::min_element(worst.begin(), worst.end()) - worst.begin());
      shown = worst[best];
      const bool again = best == 1 && levels.size() == 3;
      s.level = levels[best];
      if (!again) break;
    }
    s.statistics.estimated_relmse = shown;
    return shown;
  });
}

Image Renderer::image(std::size_t camera) {
  State& s = *state_;
  return with_device_errors(s.compute.info(), [&] {
    std::vector<cl_uint> levels;
    if (s.level > 0) levels.push_back(s.level);
    levels.push_back(0);
    const std::vector<Halves> halves = s.gather_halves(camera, levels, subpixel_positions);
    const Halves& h = halves.front();
    s.statistics.estimated_relmse = std::max(camera == 0 ? 0.0 : s.statistics.estimated_relmse, estimated_relmse(h));
    Image image{s.scene.film.x, s.scene.film.y, {}};
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

const Statistics& Renderer::statistics() const {
  State& s = *state_;
  Statistics& t = s.statistics;
  t.frames = s.frame;
  std::uint32_t samples = 0;
  for (const auto& light : s.plan.lights) samples += 2 * light.samples;
  t.evaluations =
      static_cast<double>(t.layers_texels_evaluated) * samples * s.frame * static_cast<double>(s.plan.media.size());
  t.left_out = s.plan.left_out;
  t.bytes_peak = s.compute.bytes_peak();
  t.kernel_seconds = {};
  t.kernel_seconds_known = true;
  for (const auto& [stage, seconds] : s.compute.kernel_seconds()) {
    if (stage == Stage::plan) t.kernel_seconds.plan = seconds;
    if (stage == Stage::light_map) t.kernel_seconds.light_map = seconds;
    if (stage == Stage::layers) t.kernel_seconds.layers = seconds;
    if (stage == Stage::pyramids) t.kernel_seconds.pyramids = seconds;
    if (stage == Stage::gather) t.kernel_seconds.gather = seconds;
  }
  return t;
}

const DeviceInfo& Renderer::device() const { return state_->compute.info(); }

}  // namespace parian
