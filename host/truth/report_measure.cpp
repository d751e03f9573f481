// Renders every configuration with every seed, and keeps time and error at each checkpoint.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <tuple>

#include "core/error.hpp"
#include "session/rendering.hpp"
#include "session/warnings.hpp"
#include "truth/compare.hpp"
#include "truth/machine.hpp"
#include "truth/report.hpp"
#include "truth/report_limit.hpp"
#include "truth/report_pictures.hpp"

namespace parian {
namespace {

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// A configuration before it's known whether the device takes it.
struct Candidate {
  std::string name, options;
  Settings settings;
  std::uint32_t frames = 0;
  std::vector<std::size_t> comparisons;  ///< that show it
};

/// Wall and kernel seconds and evaluations of a renderer; gathers for earlier checkpoints are taken off.
class Meter {
 public:
  explicit Meter(const Rendering& renderer) : renderer_(renderer), kernel_(kernel()), evaluations_(evaluations()) {}

  /// Times work that later checkpoints rest on.
  template <class F>
  void stay(F&& work) {
    const double start = now();
    work();
    seconds_ += now() - start;
  }
  /// Times the gather of a checkpoint, which then is the checkpoint's alone.
  template <class F>
  Checkpoint gather(F&& work) {
    const double kernel_before = kernel(), evaluations_before = evaluations(), start = now() - bias();
    work();
    Checkpoint point;
    point.frames = renderer_.frames();
    point.seconds = seconds_ + (now() - bias() - start);
    if (kernel() > 0) point.kernel_seconds = kernel() - kernel_;
    point.evaluations = evaluations() - evaluations_;
    kernel_ += kernel() - kernel_before;
    evaluations_ += evaluations() - evaluations_before;
    return point;
  }
  [[nodiscard]] double seconds() const { return seconds_; }

 private:
  /// The renderer's estimate of its bias is no part of rendering.
  [[nodiscard]] double bias() const { return renderer_.statistics().seconds.bias; }
  [[nodiscard]] double kernel() const {
    const Seconds& s = renderer_.statistics().kernel_seconds;
    return s.total - s.bias;
  }
  [[nodiscard]] double evaluations() const { return renderer_.statistics().evaluations; }

  const Rendering& renderer_;
  double seconds_ = 0, kernel_ = 0, evaluations_ = 0;
};

bool power_of_two(std::uint32_t n) { return (n & (n - 1)) == 0; }

/// One seed of one configuration. Pictures of checkpoints go to `shots` if given. No render_frames: checkpoints are at
/// powers of two whatever the renderer says, and the clock that ends a run leaves gathers out.
ReportRun render_run(const Scene& scene, const Settings& settings, const std::string& selector, const Image& reference,
                     const Limit& limit, std::uint32_t frames, double time, std::vector<Shot>* shots,
                     std::vector<std::string>& warnings) {
  Rendering renderer(scene, settings, selector);
  ReportRun run;
  run.seed = settings.seed;
  run.setup_seconds = renderer.statistics().seconds.plan;
  run.compile_seconds = renderer.statistics().seconds.compile;
  Meter meter(renderer);
  while (renderer.frames() < frames && (time <= 0 || run.checkpoints.empty() || meter.seconds() < time)) {
    meter.stay([&] { renderer.frame(); });
    if (!power_of_two(renderer.frames()) && renderer.frames() < frames) continue;
    Image image;
    // With pyramids an estimate chooses the level that the image shows: the first of all, later ones of a few.
    if (settings.pyramids && run.checkpoints.empty()) meter.stay([&] { renderer.estimate(); });
    Checkpoint point = meter.gather([&] {
      if (settings.pyramids && !run.checkpoints.empty()) renderer.estimate();
      image = renderer.image(0);
    });
    point.relmse = compare(image, reference).relmse;
    // Relative to the reference too, so that errors of all configurations can be compared.
    point.sampling_relmse = compare(image, limit.image, reference).relmse;
    if (image.estimated_relmse >= 0 && std::isfinite(image.estimated_relmse))
      point.estimated_relmse = image.estimated_relmse;
    if (shots) shots->push_back({std::move(image), point.seconds, point.frames, point.relmse});
    run.checkpoints.push_back(point);
  }
  note_warnings(warnings, renderer.statistics().warnings);
  return run;
}

/// The methods, each with and without pyramids; the last but one is Parian's default.
void add_methods(const Settings& defaults, std::uint32_t frames, std::vector<Candidate>& candidates) {
  const std::tuple<const char*, const char*, Estimator> methods[] = {
      {"poster’s disc", "--estimator disc", Estimator::disc},
      {"exponential radii", "--estimator radial", Estimator::radial},
      {"Parian", "", Estimator::automatic}};
  for (const auto& [name, options, estimator] : methods)
    for (const bool pyramids : {true, false}) {
      Candidate c{name, options, defaults, frames, {0}};
      c.settings.estimator = estimator;
      c.settings.pyramids = pyramids;
      if (estimator != Estimator::disc) c.settings.disc_radius = 0;
      if (c.settings.disc_radius > 0) c.options += fmt::format(" --disc-radius {}", c.settings.disc_radius);
      if (!pyramids) c.name += ", no pyramids";
      if (!pyramids) c.options += c.options.empty() ? "--no-pyramids" : " --no-pyramids";
      candidates.push_back(c);
    }
}

/// Half and twice one number of the default.
void add_sweep(const Settings& defaults, std::uint32_t frames, const char* option, std::uint32_t Settings::*member,
               std::size_t comparison, std::vector<Candidate>& candidates) {
  for (const bool twice : {false, true}) {
    Candidate c{"", "", defaults, frames, {comparison}};
    c.settings.*member = twice ? 2 * defaults.*member : std::max(1U, defaults.*member / 2);
    c.name = fmt::format("{} {}", option, c.settings.*member);
    c.options = fmt::format("--{} {}", option, c.settings.*member);
    candidates.push_back(c);
  }
}

/// Relative errors need light in the reference.
void check_reference(const Image& reference) {
  for (std::size_t i = 0; i < reference.rgba.size(); ++i)
    if (i % 4 < 3 && reference.rgba[i] > 0.0F) return;
  throw Error(ErrorKind::input,
              "the reference is black all over, so no error relative to it is known; light the scene");
}

constexpr std::uint32_t standard = 4, methods = 6;  // the candidates: first the methods, Parian's default among them

/// The methods, then what the sweeps add; `report` gets the comparisons that show them.
std::vector<Candidate> make_candidates(const Settings& defaults, const ReportSettings& how, Report& report) {
  std::vector<Candidate> candidates;
  report.comparisons.push_back({"Methods", "", {}, {}});
  add_methods(defaults, how.frames, candidates);
  const auto sweep = [&](const char* title, const char* option, std::uint32_t Settings::*member) {
    candidates[standard].comparisons.push_back(report.comparisons.size());
    add_sweep(defaults, how.sweep_frames, option, member, report.comparisons.size(), candidates);
    report.comparisons.push_back({title, option, {}, {}});
  };
  if (defaults.gather != Gather::camera) {
    sweep("Layer size", "layer-size", &Settings::layer_size);
    sweep("Number of layers", "layers", &Settings::layers);
  }
  sweep("Light-map size", "light-map-size", &Settings::light_map_size);
  return candidates;
}

/// Puts the configurations of each sweep in the order of its number.
void sort_sweeps(Report& report, const std::vector<Candidate>& candidates) {
  for (Comparing& c : report.comparisons) {
    std::uint32_t Settings::*member = nullptr;
    if (c.option == "layers") member = &Settings::layers;
    if (c.option == "layer-size") member = &Settings::layer_size;
    if (c.option == "light-map-size") member = &Settings::light_map_size;
    if (!member) continue;
    std::sort(c.configurations.begin(), c.configurations.end(), [&](std::uint32_t a, std::uint32_t b) {
      return candidates[a].settings.*member < candidates[b].settings.*member;
    });
    for (const std::uint32_t i : c.configurations) c.values.push_back(candidates[i].settings.*member);
  }
}

/// Finds every candidate's limit, and with it the configurations of the report. What sweeps add is taken out of
/// `candidates` where the device refuses it.
void measure_limits(std::vector<Candidate>& candidates, const Scene& scene, const std::string& selector,
                    const Image& reference, std::uint32_t seed, const ReportSettings& how, Limits& limits,
                    Report& report, const std::function<void(const std::string&)>& progress) {
  std::vector<Candidate> taken;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Candidate& c = candidates[i];
    if (how.stop()) return;
    if (progress) progress(fmt::format("limit {} of {}: {}", i + 1, candidates.size(), c.name));
    try {
      Settings settings = c.settings;
      settings.seed = seed;
      const Limit& limit = limits.of(settings, c.frames, scene, selector, reference, report.warnings);
      report.configurations.push_back({c.name, c.options, limit.to_reference.relmse, limit.variance, limit.frames});
      for (const std::size_t k : c.comparisons)
        report.comparisons[k].configurations.push_back(static_cast<std::uint32_t>(taken.size()));
      if (i == standard) {
        report.pixels = static_cast<std::uint32_t>(limit.to_reference.pixels);
        if (limit.to_reference.reference_relmse >= 0) report.reference_relmse = limit.to_reference.reference_relmse;
      }
      taken.push_back(c);
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::device || i < methods) throw;
      report.warnings.push_back(fmt::format("{} is left out: {}", c.name, error.what()));
    }
  }
  candidates = taken;
}

/// What measure_seed goes by.
struct Measuring {
  const std::vector<Candidate>& candidates;
  const Scene& scene;
  const std::string& selector;
  const Image& reference;
  const ReportSettings& how;
  const std::function<void(const std::string&)>& progress;
};

/// Renders every configuration with one seed more; pictures of the first go to `shots`. Told to stop before the last
/// one, it leaves the report without this seed and returns false.
bool measure_seed(const Measuring& m, std::uint32_t first_seed, Limits& limits, std::vector<MethodShots>& shots,
                  Report& report) {
  const std::uint32_t seed = report.seeds;
  for (std::uint32_t i = 0; i < m.candidates.size(); ++i) {
    if (m.how.stop()) {
      report.runs.resize(report.runs.size() - i);
      return false;
    }
    const Candidate& c = m.candidates[i];
    Settings settings = c.settings;
    settings.seed = first_seed + seed;
    const bool shown = seed == 0 && i < methods && settings.pyramids;
    if (shown) shots.push_back({c.name, i == standard, {}});
    const Limit& limit = limits.of(settings, c.frames, m.scene, m.selector, m.reference, report.warnings);
    report.runs.push_back(render_run(m.scene, settings, m.selector, m.reference, limit, c.frames, m.how.time,
                                     shown ? &shots.back().shots : nullptr, report.warnings));
    ReportRun& run = report.runs.back();
    run.configuration = i;
    if (m.progress)
      m.progress(fmt::format("seed {} of {}, {} of {}: {}: relMSE {:.2g} in {:.2g} s", seed + 1, m.how.seeds, i + 1,
                             m.candidates.size(), c.name, run.checkpoints.back().relmse,
                             run.checkpoints.back().seconds));
  }
  ++report.seeds;
  return true;
}

}  // namespace

Report measure(const Scene& whole, const Settings& given, const std::string& selector, const Image& reference,
               const ReportSettings& how, const std::function<void(const std::string&)>& progress) {
  const double start = now();
  check_reference(reference);
  Scene scene = whole;
  scene.cameras.resize(1);
  scene.film = {reference.width, reference.height};
  Settings defaults = given;
  defaults.estimator = Estimator::automatic;
  defaults.pyramids = true;
  defaults.error = 0;  // the bias is measured here, so nothing has to warn of it

  Report report;
  const auto load_before = load_averages();
  std::vector<Candidate> candidates = make_candidates(defaults, how, report);
  report.standard = standard;
  Limits limits;
  measure_limits(candidates, scene, selector, reference, given.seed + how.seeds, how, limits, report, progress);
  if (how.stop()) return report;
  sort_sweeps(report, candidates);

  std::vector<MethodShots> shots;
  const Measuring measuring{candidates, scene, selector, reference, how, progress};
  while (report.seeds < how.seeds && measure_seed(measuring, given.seed, limits, shots, report)) {
  }
  if (report.seeds == 0) return report;
  const Rendering renderer(scene, defaults, selector);  // for the device's name
  report.machine = describe_machine(renderer.device());
  report.machine.load_before = load_before;
  report.machine.load_after = load_averages();
  report.film = {reference.width, reference.height};
  report.difference_scale = difference_scale;
  report.pictures = picture_rows(reference, shots);
  report.material = scene.material.name;
  report.triangles = static_cast<std::uint32_t>(scene.mesh.triangles.size());
  report.lights = static_cast<std::uint32_t>(scene.lights.size());
  report.total_seconds = now() - start;
  return report;
}

}  // namespace parian
