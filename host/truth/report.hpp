// Error against run time: what `parian report` measures, and the forms in which it tells it.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "scene/scene.hpp"

namespace parian {

/// One way to render the scene.
struct Configuration {
  std::string name;         ///< as the page calls it
  std::string options;      ///< what `parian render` takes beside the report's own options
  double bias_relmse = 0;   ///< of its limit to the reference, both pictures' variances taken off
  double limit_relmse = 0;  ///< variance of the limit itself, relative as everything here
  std::uint32_t limit_frames = 0;
};

/// Configurations that differ in one number, or in the method.
struct Comparing {
  std::string title;                          ///< of the plot
  std::string option;                         ///< that differs, such as "layer-size"; empty for methods
  std::vector<std::uint32_t> configurations;  ///< indices, in the order to show them
  std::vector<std::uint32_t> values;          ///< of the option, likewise; none for methods
};

/// A run at a checkpoint.
struct Checkpoint {
  std::uint32_t frames = 0;
  double seconds = 0;                      ///< wall: all frames, the first choice of a level, this checkpoint's gather
  std::optional<double> kernel_seconds;    ///< the same by events; unknown if the device gives none
  double evaluations = 0;                  ///< of S_d, for one channel each
  double relmse = 0;                       ///< to the reference, its variance taken off
  double sampling_relmse = 0;              ///< to the configuration's limit, the limit's variance taken off
  std::optional<double> estimated_relmse;  ///< what the renderer says of itself
};

/// One seed of one configuration.
struct ReportRun {
  std::uint32_t configuration = 0, seed = 0;
  double setup_seconds = 0, compile_seconds = 0;  ///< wall, before the first frame
  std::vector<Checkpoint> checkpoints;
};

/// A PNG that the page shows.
struct Picture {
  std::string caption;
  std::uint32_t width = 0, height = 0;  ///< pixels
  std::string png;                      ///< base64
};

/// Pictures side by side, of one part of the film.
struct PictureRow {
  std::string title;
  std::vector<Picture> pictures;
};

/// Where it was measured.
struct Machine {
  std::string cpu, system, device, platform, driver, opencl, version;
  std::uint32_t cores = 0, compute_units = 0, lanes = 0;
  std::array<double, 3> load_before{}, load_after{};  ///< load averages of 1, 5 and 15 minutes
};

/// All that the page says. It's made from nothing else.
struct Report {
  std::string input, date, command;
  std::string scene;                       ///< arguments of `parian render` that all configurations share
  std::string reference_name;              ///< its file, or how it was made
  std::optional<double> reference_relmse;  ///< of its own variance; unknown if the file doesn't say
  std::uint32_t pixels = 0;                ///< that the object covers fully: those that count
  std::array<std::uint32_t, 2> film{};
  std::uint32_t seeds = 0;
  std::string material, model;
  std::uint32_t triangles = 0, lights = 0;
  double difference_scale = 0;  ///< relative error at which the false colours saturate
  double total_seconds = 0;
  Machine machine;
  std::uint32_t standard = 0;  ///< Parian's default, among the configurations
  std::vector<Configuration> configurations;
  std::vector<Comparing> comparisons;  ///< the methods first
  std::vector<ReportRun> runs;
  std::vector<PictureRow> pictures;
  std::vector<std::string> warnings;
};

/// How long to measure.
struct ReportSettings {
  std::uint32_t seeds = 5;
  std::uint32_t frames = 16;       ///< of a method's run, at most
  std::uint32_t sweep_frames = 8;  ///< of a run of a sweep, at most
  double time = 0.0;               ///< wall seconds after which a run ends at its next checkpoint; 0: no limit
  std::function<bool()> stop = [] { return false; };  ///< asked before each run, whether to end with what is whole
};

/// Renders `scene`'s first camera in every configuration and compares with `reference`, which has the film's size.
/// `settings` are Parian's default for this scene: the methods share its numbers and sweeps start from them. Progress
/// goes to `progress` as lines without an end. Configurations that the device can't hold or refuses become warnings.
/// Told to stop, it has the seeds that every configuration was rendered with; with none of them nothing else is filled.
/// Throws as Rendering and compare do. Fills all but what names the input and the reference.
[[nodiscard]] Report measure(const Scene& scene, const Settings& settings, const std::string& selector,
                             const Image& reference, const ReportSettings& how,
                             const std::function<void(const std::string&)>& progress = {});

/// The page: one XHTML file that needs nothing else.
[[nodiscard]] std::string report_html(const Report& report);
/// Everything, schema "parian-report-1".
[[nodiscard]] std::string report_json(const Report& report);
/// From what report_json made. Throws Error(input) when it's something else.
[[nodiscard]] Report read_report(const std::string& json);
/// One row per run and checkpoint, under a row of names.
[[nodiscard]] std::string report_csv(const Report& report);
/// A summary for logs: the time to each error, in Markdown.
[[nodiscard]] std::string report_markdown(const Report& report);

}  // namespace parian
