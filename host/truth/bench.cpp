// Runs frames, takes what each kernel did from the renderer's table, and sets it beside what that costs.
#include "truth/bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <utility>

#include "core/compute.hpp"
#include "core/embedded.hpp"
#include "plan/plan.hpp"
#include "truth/bench_costs.hpp"

namespace parian {
namespace {

/// Multiply-adds as fast as the device can do them with vectors of a width, in launches of some hundredths of a second.
Spread measure_peak(Compute& compute, std::uint32_t lanes, std::uint32_t runs) {
  const bool cpu = compute.info().vector_width > 1;
  const cl_uint items = compute.info().compute_units * (cpu ? 256 : 16384),
                rounds = (cpu ? 1U << 18 : 1U << 14) / lanes;
  compute.build(fmt::format("-cl-std=CL1.2 -DVW={}", lanes), bench_sources);
  cl::Buffer sums = compute.buffer<float>(items);
  std::vector<double> rates;
  for (std::uint32_t run = 0; run <= runs; ++run) {  // the first compiles
    const double before = run > 0 ? compute.kernel_seconds().at(Stage::plan) : 0.0;
    compute.launch("bench_peak", items, Stage::plan, items, rounds, 0.999F, 1e-3F, sums);
    compute.finish();
    const double seconds = compute.kernel_seconds().at(Stage::plan) - before;
    if (run > 0) rates.push_back(2.0 * PEAK_CHAINS * lanes * items * rounds / seconds);
  }
  return spread(rates);
}

/// The peak of the width that has the highest: registers may be wider than the vectors that suit a render.
Spread measure_peak(const std::string& selector, std::uint32_t runs) {
  Spread best;
  for (const std::uint32_t lanes : {1U, 4U, 8U, 16U}) {
    Compute compute(selector);
    const Spread found = with_device_errors(compute.info(), [&] { return measure_peak(compute, lanes, runs); });
    if (!std::isfinite(found.median))
      throw Error(ErrorKind::device,
                  compute.info().name + ": its driver tells no kernel times; choose another --device");
    if (found.median > best.median) best = found;
  }
  return best;
}

/// One frame and one picture.
struct Run {
  KernelTable work;
  Seconds wall;
  double covered = 0;  ///< pixels
};

KernelTable difference(const KernelTable& after, const KernelTable& before) {
  KernelTable result = after;
  for (auto& [key, work] : result)
    if (const auto b = before.find(key); b != before.end()) {
      work.launches -= b->second.launches;
      work.items -= b->second.items;
      work.seconds -= b->second.seconds;
    }
  return result;
}

Run render_once(Renderer& renderer, double& relmse) {
  const KernelTable before = renderer.kernel_table();
  const Seconds start = renderer.statistics().seconds;
  renderer.frame();
  const Image image = renderer.image(0);
  relmse = image.estimated_relmse;
  const Seconds& end = renderer.statistics().seconds;
  Run run;
  run.work = difference(renderer.kernel_table(), before);
  run.wall.light_map = end.light_map - start.light_map;
  run.wall.layers = end.layers - start.layers;
  run.wall.pyramids = end.pyramids - start.pyramids;
  run.wall.gather = end.gather - start.gather;
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) run.covered += double{image.rgba[i]};
  return run;
}

using Kernels = std::initializer_list<const char*>;
constexpr Kernels raster{"raster_setup", "raster_depth", "raster_depth_large", "raster_ids", "raster_ids_large"};
constexpr Kernels map{"light_map_resolve", "light_map_extent", "light_map_extent_up"};

KernelWork sum(const KernelTable& table, Stage stage, Kernels kernels) {
  KernelWork total;
  for (const char* kernel : kernels)
    if (const auto found = table.find({stage, kernel}); found != table.end()) {
      total.launches += found->second.launches;
      total.items += found->second.items;
      total.seconds += found->second.seconds;
    }
  return total;
}

/// Turns the runs of one scene into passes.
class Accounts {
 public:
  Accounts(const Plan& plan, const Settings& settings, const Statistics& statistics, const std::vector<Run>& runs,
           double pixels)
      : plan_(plan), settings_(settings), statistics_(statistics), runs_(runs) {
    const double samples_of_item = plan_.lanes == 1 ? 1 : std::max(plan_.lanes, POSITIONS_SIDE_BY_SIDE);
    const double gathered = items(Stage::gather, "gather_pixels") * samples_of_item;
    positions_ = std::max(1.0, gathered / pixels);
  }
  [[nodiscard]] double positions() const { return positions_; }

  [[nodiscard]] BenchPass light_map() const {
    BenchPass pass = start("light_map", Stage::light_map, &Seconds::light_map);
    add_raster(pass, Stage::light_map);
    const costs::Cost texel = costs::light_map_resolve, extent = costs::light_map_extent,
                      up = costs::light_map_extent_up;
    const double texels = items(Stage::light_map, "light_map_resolve") * plan_.lanes;
    const double extents = items(Stage::light_map, "light_map_extent");
    const double nodes = items(Stage::light_map, "light_map_extent_up");
    add(pass, Stage::light_map, "texels", "texels", map, texels,
        {texels * texel.operations + extents * extent.operations,
         texels * texel.bytes + extents * extent.bytes + nodes * up.bytes});
    return pass;
  }

  [[nodiscard]] BenchPass layers() const {
    BenchPass pass = start("layers", Stage::layers, &Seconds::layers);
    add_evaluations(pass, Stage::layers, "evaluations", {"layers_accumulate"},
                    static_cast<double>(statistics_.layers_texels_evaluated),
                    launches(Stage::layers, "layers_accumulate"));
    return pass;
  }

  [[nodiscard]] BenchPass pyramids() const {
    BenchPass pass = start("pyramids", Stage::pyramids, &Seconds::pyramids);
    // Texels that hold something: at least as large a part of each level as of the finest.
    const double finest = double(statistics_.layers_size) * statistics_.layers_size * statistics_.layers_count;
    const double full = finest > 0 ? static_cast<double>(statistics_.layers_texels_evaluated) / finest : 0.0;
    const double texels = full * items(Stage::pyramids, "pyramids_level");
    add(pass, Stage::pyramids, "texels", "texels", {"pyramids_level"}, texels,
        {texels * costs::pyramids_level.operations, texels * costs::pyramids_level.bytes});
    return pass;
  }

  [[nodiscard]] BenchPass gather() const {
    BenchPass pass = start("gather", Stage::gather, &Seconds::gather);
    add_raster(pass, Stage::gather);
    const double pixels = runs_.back().covered;
    const double operations = costs::gather_pixel.operations + statistics_.layers_count * costs::gather_layer;
    add(pass, Stage::gather, "look-ups", "pixels", {"gather_pixels"}, pixels,
        {pixels * operations, pixels * costs::gather_pixel.bytes});
    add_evaluations(pass, Stage::gather, "at pixels", {"gather_points", "layers_accumulate", "gather_direct"},
                    static_cast<double>(statistics_.fallback_pixels), static_cast<double>(plan_.lights.size()));
    return pass;
  }

 private:
  [[nodiscard]] double items(Stage stage, const char* kernel) const {
    return static_cast<double>(sum(runs_.back().work, stage, {kernel}).items);
  }
  [[nodiscard]] double launches(Stage stage, const char* kernel) const {
    return static_cast<double>(sum(runs_.back().work, stage, {kernel}).launches);
  }
  /// How often a run has a pass that a frame has once.
  [[nodiscard]] double times(Stage stage) const { return stage == Stage::gather ? positions_ : 1.0; }

  [[nodiscard]] Spread over_runs(const std::function<double(const Run&)>& seconds, double times) const {
    std::vector<double> values;
    for (const Run& run : runs_) values.push_back(seconds(run) / times);
    return spread(values);
  }

  [[nodiscard]] BenchPass start(const char* name, Stage stage, double Seconds::*member) const {
    BenchPass pass;
    pass.name = name;
    pass.wall = over_runs([&](const Run& run) { return run.wall.*member; }, times(stage));
    pass.kernel = over_runs(
        [&](const Run& run) {
          double seconds = 0;
          for (const auto& [key, work] : run.work) seconds += key.first == stage ? work.seconds : 0.0;
          return seconds;
        },
        times(stage));
    return pass;
  }

  /// Adds a part of which a frame has `count` units that cost `total` together; nothing if there are none.
  void add(BenchPass& pass, Stage stage, const char* name, const char* unit, Kernels kernels, double count,
           costs::Cost total) const {
    if (!(count > 0)) return;
    const Spread seconds =
        over_runs([&](const Run& run) { return sum(run.work, stage, kernels).seconds; }, times(stage));
    pass.parts.push_back({name, unit, count, total.operations / count, total.bytes / count, seconds});
  }

  void add_raster(BenchPass& pass, Stage stage) const {
    const double setups = items(stage, "raster_setup") / times(stage);
    const double side_by_side = stage == Stage::gather ? POSITIONS_SIDE_BY_SIDE : 1;
    const double drawn = side_by_side * items(stage, "raster_depth") / times(stage) / plan_.records;
    const double records = (items(stage, "raster_depth") + items(stage, "raster_ids")) / times(stage);
    add(pass, stage, "triangles", "triangles", raster, drawn,
        {setups * costs::raster_setup.operations + records * costs::raster_draw.operations,
         setups * costs::raster_setup.bytes + records * costs::raster_draw.bytes});
  }

  /// Of kernels that take a frame's samples at some points and read all light maps `maps` times. With fewer frames
  /// than positions, pixels that no layer sees take one frame's samples, too.
  void add_evaluations(BenchPass& pass, Stage stage, const char* name, Kernels kernels, double points,
                       double maps) const {
    double samples = 0;
    for (const PlannedLight& light : plan_.lights) samples += light.samples;
    const double pairs = 2 * points * samples, lights = static_cast<double>(plan_.lights.size());
    const double map_texels = std::min(pairs, 2.0 * settings_.light_map_size * settings_.light_map_size * maps);
    add(pass, stage, name, "evaluations", kernels, pairs * plan_.channels(),
        {pairs * operations_of_pair(),
         points * lights * costs::accumulate_bytes + map_texels * costs::map_texel_bytes});
  }

  [[nodiscard]] double operations_of_pair() const {
    const double radius = settings_.estimator == Estimator::radial ? costs::exponential_radius
                          : settings_.estimator == Estimator::disc ? costs::disc_radius
                                                                   : costs::density_radius;
    const double shared = settings_.model == Model::directional ? costs::directional_pair : 0;
    const double channel = settings_.model == Model::directional ? costs::directional_dipole
                           : settings_.model == Model::standard  ? costs::standard_dipole
                                                                 : costs::better_dipole;
    return costs::sample + radius + shared + plan_.channels() * (channel + costs::sum_of_channel);
  }

  const Plan& plan_;
  const Settings& settings_;
  const Statistics& statistics_;
  const std::vector<Run>& runs_;
  double positions_ = 1;
};

}  // namespace

Bench bench(const Scene& scene, const Settings& settings, const std::string& selector, std::uint32_t runs) {
  Scene one = scene;
  one.cameras.resize(1);
  Settings every = settings;
  every.keep.insert({"light-map-redraws", "pyramids", "interior-positions"});  // so that each frame has each pass
  Bench result;
  result.runs = runs;
  result.peak = measure_peak(selector, runs);
  Renderer renderer(one, every, selector);
  std::vector<Run> counted;  // not render_frames: each frame has a picture, and the tables around it
  for (std::uint32_t run = 0; run <= runs; ++run) {  // the first compiles
    Run done = render_once(renderer, result.relmse);
    if (run > 0) counted.push_back(std::move(done));
  }
  result.device = renderer.device();
  result.frames = renderer.frames();
  result.statistics = renderer.statistics();
  const Plan plan = make_plan(one, every, renderer.device());
  const Accounts accounts(plan, every, result.statistics, counted, double(one.film.x) * one.film.y);
  result.positions = static_cast<std::uint32_t>(accounts.positions());
  for (const BenchPass& pass : {accounts.light_map(), accounts.layers(), accounts.pyramids(), accounts.gather()})
    if (pass.kernel.high > 0) result.passes.push_back(pass);
  return result;
}

}  // namespace parian
