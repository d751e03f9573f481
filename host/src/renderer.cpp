// One scene on one device: the second half of the plan, then frames. The algorithm is four calls: draw_light_maps,
// accumulate_layers, build_pyramids, gather.
#include "renderer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "renderer_state.hpp"
#include "self_test.hpp"

namespace parian {
namespace {

constexpr std::uint32_t coarsest_level = 6;  // more blur than 64 texels shows nothing
// Of an estimate that looks at one subpixel position, in 1/256: where a bilinear look-up averages noise away as much as
// a whole pixel's look-ups do if texels are pixels, (0.78^2 + 0.22^2)^2 = (0.125^2 + 0.75^2 + 0.125^2)^2.
constexpr int single_position = 200;
constexpr std::uint32_t interior_positions = POSITIONS_SIDE_BY_SIDE;  // of pixels without an edge near by

}  // namespace

void Renderer::State::prepare() {
  {
    Timer timer(statistics.seconds.compile);
    compute.build(plan.options);
  }
  with_device_errors(compute.info(), [&] {
    Timer timer(statistics.seconds.plan);
    if (device_mesh) fit_sphere();
    for (auto& doubt : require_sound(compute, settings, plan.lanes)) plan.warnings.push_back(doubt);
    passes.seed = settings.seed;
    if (plan.unit_lights && plan.lights.size() == 1) colour = plan.lights[0].light.irradiance;
    for (const Camera& camera : scene.cameras) cameras.push_back(pinhole_view(camera, plan.space, scene.film));
    if (device_mesh) {
      allocate_geometry(passes, scene.on_device->positions, scene.on_device->triangles);
      read_geometry(passes, *device_mesh);
    } else {
      upload_geometry(passes, scene.mesh);
    }
    scene.mesh.normals = {};  // at millions of triangles each copy counts
    for (glm::dvec3& x : scene.mesh.positions) x = (x - plan.space.centre) / plan.space.radius;
    passes.media = compute.upload(plan.media);
    passes.rho = compute.upload(plan.density.rho);
    allocate_film();
    touch_film();
    make_light_maps(passes, device_mesh ? sphere_points() : scene.mesh.positions, settings.light_map_size);
    draw_light_maps(passes, 0, settings.light_map_shift);
    if (settings.still)
      plan_layers();
    else
      plan_live_layers();
    scene.mesh = {};
    measure_rate();
    compute.finish();
  });
}

void Renderer::State::settle() {
  if (settings.time_stages) compute.finish();
}

/// Buffers of one window of the film. Where there is no room for them, smaller windows are tried.
void Renderer::State::allocate_film() {
  Film& f = passes.film;
  for (;; plan.window /= 2) {
    for (cl::Buffer* b : {&f.depth, &f.ids, &f.direct, &f.n_direct, &f.n_held, &f.points, &f.centres, &f.values,
                          &f.edges, &f.open, &f.sums})
      compute.release(*b);
    const std::size_t pixels = std::size_t{std::min(scene.film.x, plan.window)} * std::min(scene.film.y, plan.window);
    const std::size_t held = std::min<std::size_t>(pixels, direct_points);
    try {
      f.depth = compute.buffer<cl_uint>(pixels * POSITIONS_SIDE_BY_SIDE);
      f.ids = compute.buffer<cl_uint>(pixels * POSITIONS_SIDE_BY_SIDE);
      f.direct = compute.buffer<cl_uint>(pixels * POSITIONS_SIDE_BY_SIDE);
      f.n_direct = compute.buffer<cl_uint>(POSITIONS_SIDE_BY_SIDE + 1);
      f.n_held = compute.buffer<cl_uint>(1);
      f.points = compute.buffer<kernels::float4>(2 * held);
      f.centres = compute.buffer<kernels::float4>(plan.lights.size() * held);
      f.values = compute.buffer<kernels::float4>(2 * held);
      f.edges = compute.buffer<cl_uint>(pixels);
      f.open = compute.buffer<cl_uint>(pixels);
      f.sums = compute.buffer<kernels::float4>(pixels * 2 * (plan.pyramids ? 3 : 1));
      return;
    } catch (const cl::Error& e) {
      if (e.err() != CL_MEM_OBJECT_ALLOCATION_FAILURE || plan.window <= smallest_window) throw;
    } catch (const Error& e) {  // of a scratch buffer
      if (e.code() != CL_MEM_OBJECT_ALLOCATION_FAILURE || plan.window <= smallest_window) throw;
    }
  }
}

/// Some drivers find memory when it is first used: while planning, and not in the first picture's time.
void Renderer::State::touch_film() {
  const Film& f = passes.film;
  const std::size_t pixels = std::size_t{std::min(scene.film.x, plan.window)} * std::min(scene.film.y, plan.window);
  for (const cl::Buffer* b : {&f.depth, &f.ids, &f.direct}) compute.fill(*b, 0, pixels * POSITIONS_SIDE_BY_SIDE);
  compute.fill(f.sums, 0, pixels * 8 * (plan.pyramids ? 3 : 1));
}

/// One subpixel position tells a pixel's error where texels are as large as pixels; elsewhere about one per texel does.
std::uint32_t Renderer::State::positions_of_estimate(std::size_t camera) const {
  const double texels = texels_per_pixel(passes.layers, cameras[camera]);
  return static_cast<std::uint32_t>(std::clamp(std::ceil(texels * texels - 0.5), 1.0, 16.0));
}

LayerRange Renderer::State::layers_of(std::size_t camera) const {
  if (plan.gather == Gather::camera) return {static_cast<cl_uint>(camera), 1};
  return {0, passes.layers.count()};
}

std::vector<kernels::View> Renderer::State::placed_layers(SurfaceSight& sight) {
  std::vector<kernels::View> views = place_layers(passes, scene.mesh.positions, scene.mesh.triangles, settings.layers,
                                                  settings.layer_size, sight, kept(settings, "redundant-layers"));
  leave_out("redundant-layers", fmt::format("{} layers see all of the surface as well as more would", views.size()),
            "layers", settings.layers - static_cast<double>(views.size()));
  for (std::size_t k = 0; k < views.size(); ++k) views[k].number = static_cast<cl_uint>(k);
  return views;
}

void Renderer::State::plan_layers() {
  if (plan.gather == Gather::camera) {  // nothing to place, and all that is seen is read
    std::vector<kernels::View> views;
    for (const kernels::View& camera : cameras) views.push_back(camera_layer(camera));
    make_layers(passes, views, plan.pyramids);
    const std::vector<cl_uint> seen = covered_texels(passes);
    set_needed(passes, seen);
    count_layers(seen.size(), seen.size());
    statistics.layers_covered = 1.0;  // until a picture finds pixels whose points no texel stands for
    return;
  }
  SurfaceSight sight;
  const std::vector<kernels::View> views = placed_layers(sight);
  make_layers(passes, views, plan.pyramids);
  statistics.layers_covered = layer_coverage(passes, sight);
  std::vector<cl_uint> needed = covered_texels(passes);
  const std::size_t covered = needed.size();
  if (!kept(settings, "unread-texels")) needed = read_texels(passes, cameras, scene.film);

  // Layers of which nothing is read cost memory and look-ups: the others are drawn again without them.
  const cl_uint per_layer = settings.layer_size * settings.layer_size;
  std::vector<cl_uint> new_index(views.size(), 0);
  for (const cl_uint t : needed) new_index[t / per_layer] = 1;
  const auto idle = static_cast<std::size_t>(std::count(new_index.begin(), new_index.end(), 0U));
  if (idle > 0 && idle < views.size() && !kept(settings, "idle-layers")) {
    std::vector<kernels::View> busy;
    for (std::size_t k = 0; k < views.size(); ++k)
      if (new_index[k]) {
        new_index[k] = static_cast<cl_uint>(busy.size());
        busy.push_back(views[k]);
      }
    for (cl_uint& t : needed) t = new_index[t / per_layer] * per_layer + t % per_layer;
    const std::size_t before = passes.layers.level_first.back();
    release_layers(passes);
    make_layers(passes, busy, plan.pyramids);
    leave_out("idle-layers", fmt::format("{} of {} layers see nothing that a camera reads", idle, views.size()),
              "bytes", static_cast<double>((before - passes.layers.level_first.back()) * 20));
  }
  set_needed(passes, needed);
  leave_out("unread-texels",
            fmt::format("{} of {} covered texels are read by no camera", covered - needed.size(), covered),
            "evaluations", static_cast<double>(covered - needed.size()) * samples_per_frame() * plan.channels());
  count_layers(covered, needed.size());
}

void Renderer::State::count_layers(std::size_t covered, std::size_t needed) {
  for (Omission& o : plan.left_out)
    if (o.what == "equal-channels" || o.what == "black-channels")
      o.count = static_cast<double>(needed) * samples_per_frame();
  statistics.layers_count = passes.layers.count();
  statistics.layers_size = std::max(passes.layers.views.front().width, passes.layers.views.front().height);
  statistics.layers_texels = covered;
  statistics.layers_texels_evaluated = needed;
}

Renderer::Renderer(Scene scene, const Settings& settings, const std::string& selector)
    : Renderer(std::move(scene), settings, std::make_shared<Compute>(selector), nullptr) {}

Renderer::Renderer(Scene scene, const Settings& settings, std::shared_ptr<Compute> compute, const DeviceMesh* mesh)
    : state_(std::make_unique<State>(std::move(scene), settings, std::move(compute), mesh)) {
  try {
    state_->prepare();
  } catch (...) {
    leave();
    throw;
  }
}

Renderer::~Renderer() { leave(); }

/// Buffers of a driver that is of no use any more can't be released.
void Renderer::leave() noexcept {
  if (state_ && state_->compute.abandoned()) (void)state_.release();
}

void Renderer::frame() {
  State& s = *state_;
  with_device_errors(s.compute.info(), [&] {
    s.apply_changes();
    std::uint32_t most = 0;
    for (const auto& light : s.plan.lights) most = std::max(most, light.samples);
    const std::uint32_t epoch = s.settings.light_map_shift ? s.frame * most / redraw_samples : 0;
    const bool redrawn = epoch != s.epoch || (s.frame > 0 && kept(s.settings, "light-map-redraws"));
    if (redrawn) {
      Timer timer(s.statistics.seconds.light_map);
      s.epoch = epoch;
      ++s.redraws;
      draw_light_maps(s.passes, epoch, s.settings.light_map_shift);
      s.settle();
    }
    Timer timer(s.statistics.seconds.layers);
    if (redrawn) make_guides(s.passes);
    accumulate_layers(s.passes, s.frame);
    s.settle();
    ++s.frame;
  });
}

std::uint32_t Renderer::frames() const { return state_->frame; }

bool Renderer::checkpoint() const {
  State& s = *state_;
  std::uint32_t n = s.frame;
  while (n > 4 && n % 2 == 0) n /= 2;
  if (n < 1 || n > 4) return false;
  // Error falls about as one over the frames, never as their square: until then it needn't be asked for.
  const double ratio = static_cast<double>(s.estimated_at) / s.frame;
  const bool hopeless = s.estimated_at > 0 && s.statistics.estimated_relmse * ratio * ratio > s.settings.error;
  if (!hopeless || !(s.settings.error > 0) || kept(s.settings, "checkpoints")) return true;
  if (s.last_unestimated != s.frame) ++s.unestimated;  // however often it is asked
  s.last_unestimated = s.frame;
  return false;
}

bool Renderer::State::settles(std::uint32_t positions) const {
  return positions > interior_positions && !kept(settings, "interior-positions");
}

/// All subpixel positions of one window; those of edges alone after the first few.
void Renderer::State::gather_window(std::size_t camera, kernels::Window w, const std::vector<cl_uint>& levels,
                                    std::uint32_t positions) {
  const kernels::View& view = cameras[camera];
  const std::uint32_t rounds = (frame + positions - 1) / positions;
  const bool settling = settles(positions);
  for (std::uint32_t i = 0; i < positions;) {
    if (settling && i == interior_positions) {
      settle_film(passes, w, levels.size(), i, positions);
      restrict_film(passes, view, w);
    }
    std::uint32_t count = 1;
    if (positions == 1)
      w.sample_x = w.sample_y = single_position;
    else
      count = set_positions(w, i, positions - i);
    undrawn += !draw_film(passes, view, w, kept(settings, "camera-redraws"), Stage::gather);
    if (settling && i == 0) find_edges(passes, view, w);
    gather(passes, view, w, layers_of(camera), levels, 1.0F / static_cast<float>(frame), i * rounds, rounds,
           Stage::gather);
    i += count;
  }
  if (settling) free_film(passes, w);
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
  colour_layers(passes);
  if (plan.pyramids) {
    Timer timer(statistics.seconds.pyramids);
    const std::uint32_t all = passes.layers.levels - 1, read = *std::max_element(levels.begin(), levels.end());
    const std::uint32_t built = kept(settings, "pyramids") ? all : read;
    build_pyramids(passes, built);
    unbuilt += all - built;
    compute.finish();
  }
  std::uint64_t direct = 0;
  const glm::vec3 weight(colour / static_cast<double>(positions));
  const std::uint32_t rounds = (frame + positions - 1) / positions;
  for (kernels::Window w : tiles(scene.film, plan.window)) {
    const std::size_t pixels = std::size_t{w.width} * w.height;
    {
      Timer timer(statistics.seconds.gather);
      compute.fill(passes.film.sums, 0, pixels * 8 * levels.size());
      compute.fill(passes.film.n_direct, 0, POSITIONS_SIDE_BY_SIDE + 1);
      gather_window(camera, w, levels, positions);
      compute.finish();
    }
    Timer timer(statistics.seconds.read);
    std::vector<kernels::float4>& sums = film_sums;
    sums.resize(pixels * 2 * levels.size());
    compute.read_into(sums, passes.film.sums);
    direct += compute.read<cl_uint>(passes.film.n_direct, 1, POSITIONS_SIDE_BY_SIDE)[0];
    if (settles(positions)) {
      const std::vector<cl_uint> open = compute.read<cl_uint>(passes.film.open, pixels);
      for (std::size_t i = 0; i < pixels; ++i)
        if (!open[i] && sums[2 * i].w > 0) unasked += positions - interior_positions;
    }
    for (std::size_t set = 0; set < levels.size(); ++set)
      for (std::size_t i = 0; i < pixels; ++i) {
        const kernels::float4 a = sums[2 * (set * pixels + i)], b = sums[2 * (set * pixels + i) + 1];
        const std::size_t at = (w.y + i / w.width) * scene.film.x + w.x + i % w.width;
        halves[set].a[at] = glm::vec3(a.x, a.y, a.z) * weight;
        halves[set].b[at] = glm::vec3(b.x, b.y, b.z) * weight;
        halves[set].alpha[at] = a.w / static_cast<float>(positions);
      }
  }
  direct_evaluations += static_cast<double>(direct) * rounds * samples_per_frame() * plan.channels();
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

const KernelTable& Renderer::kernel_table() const { return state_->compute.kernel_table(); }

const DeviceInfo& Renderer::device() const { return state_->compute.info(); }

}  // namespace parian
