// Renders every configuration with every seed, and keeps time and error at each checkpoint.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <tuple>

#include "compare.hpp"
#include "error.hpp"
#include "machine.hpp"
#include "renderer.hpp"
#include "report.hpp"
#include "report_pictures.hpp"

namespace parian {
namespace {

constexpr std::uint32_t limit_factor = 4;  // frames of each half of a limit, in those of the longest run

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// A configuration before it's known whether the device takes it.
struct Candidate {
  std::string name, options;
  Settings settings;
  std::uint32_t frames = 0;
  std::vector<std::size_t> comparisons;  ///< that show it
};

/// What pictures are held against.
struct Yardstick {
  Image limit;
  std::uint32_t frames = 0;
  Comparison bias;
  double variance = 0;  ///< relative, of the limit
};

/// Mean over the pixels that all three cover fully of ((I - L)^2 - var L) / (R^2 + eps^2), at least 0, and of
/// var L / (R^2 + eps^2). The reference's norm makes errors of all configurations comparable.
std::pair<double, double> sampling_error(const Image& picture, const Image& limit, const Image& reference) {
  constexpr float covered = 0.999F;
  double sum = 0, count = 0;
  const std::size_t pixels = reference.rgba.size() / 4;
  const auto counts = [&](std::size_t i) {
    return std::min({picture.rgba[4 * i + 3], limit.rgba[4 * i + 3], reference.rgba[4 * i + 3]}) >= covered;
  };
  for (std::size_t i = 0; i < pixels; ++i) {
    if (!counts(i)) continue;
    ++count;
    for (int c = 0; c < 3; ++c) sum += static_cast<double>(reference.rgba[4 * i + c]);
  }
  const double epsilon = 0.01 * sum / (3 * count);
  double squared = 0, variance = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    if (!counts(i)) continue;
    for (int c = 0; c < 3; ++c) {
      const double r = reference.rgba[4 * i + c], e = limit.standard_error[3 * i + c];
      const double d = static_cast<double>(picture.rgba[4 * i + c]) - static_cast<double>(limit.rgba[4 * i + c]);
      const double norm = 3 * count * (r * r + epsilon * epsilon);
      if (!(norm > 0)) continue;  // an all-black reference: compare has judged it
      squared += d * d / norm;
      variance += e * e / norm;
    }
  }
  return {std::max(0.0, squared - variance), variance};
}

void note_warnings(Report& report, const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings)
    if (std::find(report.warnings.begin(), report.warnings.end(), warning) == report.warnings.end())
      report.warnings.push_back(warning);
}

/// The mean of two pictures with seeds of their own; half their difference is its standard error. Made without
/// pyramids: in the limit level 0 is shown.
Image make_limit(const Scene& scene, Settings settings, const std::string& selector, std::uint32_t frames,
                 Report& report) {
  settings.pyramids = false;
  Image halves[2];
  for (Image& half : halves) {
    Renderer renderer(scene, settings, selector);
    ++settings.seed;
    while (renderer.frames() < frames) renderer.frame();
    half = renderer.image(0);
    note_warnings(report, renderer.statistics().warnings);
  }
  Image& limit = halves[0];
  for (std::size_t i = 0; i < limit.rgba.size(); ++i) {
    const float a = halves[0].rgba[i], b = halves[1].rgba[i];
    limit.rgba[i] = 0.5F * (a + b);
    if (i % 4 < 3) limit.standard_error.push_back(0.5F * std::abs(a - b));
  }
  return limit;
}

/// Wall and kernel seconds and evaluations of a renderer; gathers for earlier checkpoints are taken off.
class Meter {
 public:
  explicit Meter(const Renderer& renderer) : renderer_(renderer), kernel_(kernel()), evaluations_(evaluations()) {}

  template <class F>
  void frame(F&& work) {
    const double start = now();
    work();
    seconds_ += now() - start;
  }
  /// Times the gather of a checkpoint, which then is the checkpoint's alone.
  template <class F>
  Checkpoint gather(F&& work) {
    const double kernel_before = kernel(), evaluations_before = evaluations(), start = now();
    work();
    Checkpoint point;
    point.frames = renderer_.frames();
    point.seconds = seconds_ + now() - start;
    if (kernel() > 0) point.kernel_seconds = kernel() - kernel_;
    point.evaluations = evaluations() - evaluations_;
    kernel_ += kernel() - kernel_before;
    evaluations_ += evaluations() - evaluations_before;
    return point;
  }
  [[nodiscard]] double seconds() const { return seconds_; }

 private:
  [[nodiscard]] double kernel() const { return renderer_.statistics().kernel_seconds.total; }
  [[nodiscard]] double evaluations() const { return renderer_.statistics().evaluations; }

  const Renderer& renderer_;
  double seconds_ = 0, kernel_ = 0, evaluations_ = 0;
};

bool power_of_two(std::uint32_t n) { return (n & (n - 1)) == 0; }

/// One seed of one configuration. Pictures of checkpoints go to `shots` if given.
ReportRun render_run(const Scene& scene, const Candidate& candidate, const Settings& settings,
                     const std::string& selector, const Image& reference, const Yardstick& yardstick, double time,
                     std::vector<Shot>* shots, Report& report) {
  Renderer renderer(scene, settings, selector);
  ReportRun run;
  run.seed = settings.seed;
  run.setup_seconds = renderer.statistics().seconds.plan;
  run.compile_seconds = renderer.statistics().seconds.compile;
  Meter meter(renderer);
  while (renderer.frames() < candidate.frames && (time <= 0 || run.checkpoints.empty() || meter.seconds() < time)) {
    meter.frame([&] { renderer.frame(); });
    if (!power_of_two(renderer.frames()) && renderer.frames() < candidate.frames) continue;
    Image image;
    Checkpoint point = meter.gather([&] {
      if (settings.pyramids) renderer.estimate();  // chooses the level that the image shows
      image = renderer.image(0);
    });
    point.relmse = compare(image, reference).relmse;
    point.sampling_relmse = sampling_error(image, yardstick.limit, reference).first;
    if (image.estimated_relmse >= 0 && std::isfinite(image.estimated_relmse))
      point.estimated_relmse = image.estimated_relmse;
    if (shots) shots->push_back({std::move(image), point.seconds, point.frames, point.relmse});
    run.checkpoints.push_back(point);
  }
  note_warnings(report, renderer.statistics().warnings);
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

constexpr std::size_t standard = 4;  // Parian's default, among the candidates

/// The methods, then what the sweeps add; `report` gets the comparisons that show them.
std::vector<Candidate> make_candidates(const Settings& defaults, const ReportSettings& how, Report& report) {
  std::vector<Candidate> candidates;
  report.comparisons.push_back({"Methods", "", {}});
  add_methods(defaults, how.frames, candidates);
  const auto sweep = [&](const char* title, const char* option, std::uint32_t Settings::*member) {
    candidates[standard].comparisons.push_back(report.comparisons.size());
    add_sweep(defaults, how.sweep_frames, option, member, report.comparisons.size(), candidates);
    report.comparisons.push_back({title, option, {}});
  };
  if (defaults.gather != Gather::camera) {
    sweep("Layer size", "layer-size", &Settings::layer_size);
    sweep("Number of layers", "layers", &Settings::layers);
  }
  sweep("Light-map size", "light-map-size", &Settings::light_map_size);
  return candidates;
}

/// Limits, one for all candidates that converge to the same picture.
class Yardsticks {
 public:
  const Yardstick& of(const Candidate& c, const Scene& scene, const std::string& selector, const Image& reference,
                      std::uint32_t seed, Report& report) {
    const Settings& s = c.settings;
    Yardstick& y = made_[{s.estimator, s.layers, s.layer_size, s.light_map_size}];
    if (y.frames > 0) return y;
    Settings settings = s;
    settings.seed = seed;
    const std::uint32_t frames = limit_factor * c.frames;
    y.limit = make_limit(scene, settings, selector, frames, report);
    y.bias = compare(y.limit, reference);
    y.variance = sampling_error(y.limit, y.limit, reference).second;
    y.frames = 2 * frames;
    return y;
  }

 private:
  std::map<std::tuple<Estimator, std::uint32_t, std::uint32_t, std::uint32_t>, Yardstick> made_;
};

/// Puts the configurations of each sweep in the order of its number.
void sort_sweeps(Report& report, const std::vector<Settings>& settings) {
  const auto by = [&](std::uint32_t Settings::*member) {
    return [&, member](std::uint32_t a, std::uint32_t b) { return settings[a].*member < settings[b].*member; };
  };
  for (Comparing& c : report.comparisons) {
    if (c.option == "layers") std::sort(c.configurations.begin(), c.configurations.end(), by(&Settings::layers));
    if (c.option == "layer-size")
      std::sort(c.configurations.begin(), c.configurations.end(), by(&Settings::layer_size));
    if (c.option == "light-map-size")
      std::sort(c.configurations.begin(), c.configurations.end(), by(&Settings::light_map_size));
  }
}

}  // namespace

Report measure(const Scene& whole, const Settings& given, const std::string& selector, const Image& reference,
               const ReportSettings& how, const std::function<void(const std::string&)>& progress) {
  const double start = now();
  Scene scene = whole;
  scene.cameras.resize(1);
  scene.film = {reference.width, reference.height};
  Settings defaults = given;
  defaults.estimator = Estimator::automatic;
  defaults.pyramids = true;

  Report report;
  report.machine.load_before = load_averages();
  std::vector<Candidate> candidates = make_candidates(defaults, how, report);
  Yardsticks yardsticks;
  std::vector<Candidate> taken;
  std::vector<Settings> settings;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Candidate& c = candidates[i];
    if (progress) progress(fmt::format("limit {} of {}: {}", i + 1, candidates.size(), c.name));
    try {
      const Yardstick& y = yardsticks.of(c, scene, selector, reference, given.seed + how.seeds, report);
      const auto index = static_cast<std::uint32_t>(taken.size());
      if (i == standard) report.standard = index;
      report.configurations.push_back({c.name, c.options, y.bias.relmse, y.variance, y.frames});
      for (const std::size_t k : c.comparisons) report.comparisons[k].configurations.push_back(index);
      if (y.bias.reference_relmse >= 0) report.reference_relmse = y.bias.reference_relmse;
      if (i == standard) report.pixels = static_cast<std::uint32_t>(y.bias.pixels);
      taken.push_back(c);
      settings.push_back(c.settings);
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::device || i <= standard) throw;
      report.warnings.push_back(fmt::format("{} is left out: {}", c.name, error.what()));
    }
  }
  sort_sweeps(report, settings);

  std::vector<MethodShots> shots;
  for (std::uint32_t seed = 0; seed < how.seeds; ++seed)
    for (std::size_t i = 0; i < taken.size(); ++i) {
      const Candidate& c = taken[i];
      Settings s = c.settings;
      s.seed = given.seed + seed;
      const bool shown = seed == 0 && c.comparisons.front() == 0 && s.pyramids;
      if (shown) shots.push_back({c.name, i == report.standard, {}});
      const Yardstick& y = yardsticks.of(c, scene, selector, reference, 0, report);
      ReportRun run =
          render_run(scene, c, s, selector, reference, y, how.time, shown ? &shots.back().shots : nullptr, report);
      run.configuration = static_cast<std::uint32_t>(i);
      if (progress)
        progress(fmt::format("seed {} of {}, {} of {}: {}: relMSE {:.2g} in {:.2g} s", seed + 1, how.seeds, i + 1,
                             taken.size(), c.name, run.checkpoints.back().relmse, run.checkpoints.back().seconds));
      report.runs.push_back(std::move(run));
    }
  const Renderer any(scene, defaults, selector);
  const auto load = report.machine.load_before;
  report.machine = describe_machine(any.device());
  report.machine.load_before = load;
  report.machine.load_after = load_averages();
  report.film = {reference.width, reference.height};
  report.seeds = how.seeds;
  report.difference_scale = difference_scale;
  report.pictures = picture_rows(reference, shots);
  report.material = scene.material.name;
  report.triangles = static_cast<std::uint32_t>(scene.mesh.triangles.size());
  report.lights = static_cast<std::uint32_t>(scene.lights.size());
  report.total_seconds = now() - start;
  return report;
}

}  // namespace parian
