// `parian report`: error against run time, as a page with its data beside it.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <memory>

#include "cli/commands.hpp"
#include "cli/driver_guard.hpp"
#include "cli/interrupt.hpp"
#include "cli/progress.hpp"
#include "cli/terminal.hpp"
#include "core/ascii.hpp"
#include "io/whole_file.hpp"
#include "truth/reference.hpp"
#include "truth/report.hpp"

namespace parian {
namespace {

constexpr std::uint32_t most_seeds = 1000;
constexpr std::uint32_t film_side = 128;     // longest side, unless something else is asked for
constexpr double reference_error = 2e-4;     // own relMSE of a reference that the report makes itself
constexpr double reference_seconds = 180.0;  // and how long that may take

struct ReportOptions {
  InputOptions input;
  std::string output, reference, seeds;
  bool quiet = false;
};

/// A word as a shell takes it.
std::string quoted(const std::string& word) {
  const auto plain = [](char c) {
    return ascii::is_lower(ascii::lower(c)) || ascii::is_digit(c) || std::strchr("-_./:,=+%", c);
  };
  if (!word.empty() && std::all_of(word.begin(), word.end(), plain)) return word;
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

/// The input and the options about it that `render` and `reference` know too, as they were given.
std::string scene_arguments(const InputOptions& options, const std::string& size) {
  std::string text = quoted(options.input);
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) text += fmt::format(" --{} {}", name, quoted(value));
  };
  add("material", options.material);
  add("size-mm", options.size_mm);
  for (const std::string& light : options.lights) add("light", light);
  add("camera", options.camera);
  add("fov", options.fov);
  add("size", size);
  return text;
}

/// The options of `render` beside those, as they were given.
std::string setting_arguments(const InputOptions& options) {
  std::string text;
  const auto& table = render_options();
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (options.flags[i]) text += " --" + table[i].name;
    if (table[i].name == "frames" || table[i].name == "time") continue;
    for (const std::string& value : options.settings[i]) text += fmt::format(" --{} {}", table[i].name, quoted(value));
  }
  if (!options.device.empty()) text += " --device " + quoted(options.device);
  return text;
}

std::string size_text(glm::uvec2 film) { return fmt::format("{}x{}", film.x, film.y); }

std::string name_of(Model model) {
  Settings settings;
  settings.model = model;
  for (const RenderOption& option : render_options())
    if (option.name == "model") return option.text(settings);
  return {};
}

/// How long to measure: --frames and --time bound runs only if the command line has them.
ReportSettings report_settings(const ReportOptions& options, const Overrides& overrides, const Settings& settings) {
  ReportSettings how;
  if (!options.seeds.empty()) how.seeds = parse_whole("--seeds", options.seeds, 1, most_seeds);
  for (const auto& [option, value] : overrides.settings) {
    if (option->name == "frames") how.frames = how.sweep_frames = settings.frames;
    if (option->name == "time") how.time = settings.time;
  }
  return how;
}

/// The film of a report that was asked for none: the scene's shape, in fewer pixels.
glm::uvec2 small_film(glm::uvec2 film) {
  const double scale = std::min(1.0, static_cast<double>(film_side) / std::max(film.x, film.y));
  return glm::max(glm::uvec2(1), glm::uvec2(glm::round(glm::dvec2(film) * scale)));
}

/// The reference, from its file or made here, and what the page says of it.
Image get_reference(const ReportOptions& options, const Scene& scene, Model model, std::string& name) {
  if (!options.reference.empty()) {
    name = options.reference;
    return read_image(options.reference);
  }
  ReferenceSettings how;
  how.model = model;
  how.target = reference_error;
  how.time = reference_seconds;
  const Stopping ends{.error = how.target, .time = how.time};  // batches aren't counted
  ReferenceState state;
  {
    ProgressBar bar(!options.quiet, "batch of the reference");
    const Clock clock;
    render_reference(scene, how, state, [&](std::uint32_t batches, double error) {
      bar.update(progress_of(ends, batches, error, clock.seconds()));
      return !interrupted();
    });
  }
  name = fmt::format("made by “parian reference {} --model {} --error {} --time {}”: {} batches of {} samples",
                     scene_arguments(options.input, size_text(scene.film)), name_of(model), how.target, how.time,
                     state.batches, state.samples);
  return reference_image(state);
}

std::string date_now() { return fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr))); }

std::string command_line(const ReportOptions& options, const std::string& scene, const ReportSettings& how) {
  std::string text = "parian report " + scene;
  if (!options.reference.empty()) text += " --reference " + quoted(options.reference);
  text += fmt::format(" --seeds {}", how.seeds);
  const ReportSettings usual;
  if (how.frames != usual.frames || how.sweep_frames != usual.sweep_frames)
    text += fmt::format(" --frames {}", how.frames);
  if (how.time > 0) text += fmt::format(" --time {}", how.time);
  return text + " -o " + quoted(options.output);
}

constexpr std::array beside_page = {".json", ".csv", ".md"};

/// Files beside the page.
std::filesystem::path beside(const std::string& page, const char* extension) {
  return std::filesystem::path(page).replace_extension(extension);
}

void check_outputs(const ReportOptions& options) {
  const std::string extension = std::filesystem::path(options.output).extension().string();
  if (extension != ".html" && extension != ".xhtml") {
    throw Error(ErrorKind::usage, fmt::format("-o {}: a report is a page; end its name in .html", options.output));
  }
  check_place(options.output);
  for (const char* e : beside_page) check_place(beside(options.output, e));
}

/// All files that are read and written: none may replace another.
void check_names(const ReportOptions& options, const Input& input) {
  FileUses files;
  note_inputs(input, files);
  if (!options.reference.empty()) files.reads("--reference", options.reference);
  files.writes("-o", options.output);
  for (const char* e : beside_page) files.writes(fmt::format("the report's {}", e), beside(options.output, e));
}

int run_report(const ReportOptions& options) {
  const Overrides overrides = options.input.overrides();
  check_outputs(options);
  Input input = load_input(options.input.input, overrides);
  check_names(options, input);
  ReportSettings how = report_settings(options, overrides, input.settings);
  how.stop = interrupted;
  if (!overrides.film) input.scene.film = small_film(input.scene.film);
  const std::string selector = options.input.device_selector(input.device);
  std::string reference_name;
  listen_for_interrupt();
  const Image reference = get_reference(options, input.scene, input.settings.model, reference_name);
  if (overrides.film && *overrides.film != glm::uvec2(reference.width, reference.height)) {
    throw Error(ErrorKind::usage, fmt::format("--size: {} has {}x{} pixels; leave --size out, or give the same",
                                              options.reference, reference.width, reference.height));
  }
  guard_drivers();
  Report report = measure(input.scene, input.settings, selector, reference, how, [&](const std::string& line) {
    if (!options.quiet) say(line);
  });
  if (report.seeds == 0) {
    say("interrupted before every configuration had run once: nothing is written; give it more time");
    return exit_interrupted();
  }
  const bool whole = report.seeds == how.seeds;
  how.seeds = report.seeds;
  const std::string scene =
      scene_arguments(options.input, size_text({reference.width, reference.height})) + setting_arguments(options.input);
  report.input = std::filesystem::path(options.input.input).filename().string();
  report.date = date_now();
  report.command = command_line(options, scene, how);
  report.scene = scene;
  report.reference_name = reference_name;
  report.model = name_of(input.settings.model);
  const std::string json = report_json(report);
  report = read_report(json);  // file names that are no text are mended there
  write_text(beside(options.output, ".json"), json);
  write_text(beside(options.output, ".csv"), report_csv(report));
  write_text(beside(options.output, ".md"), report_markdown(report));
  write_text(options.output, report_html(report));
  if (!options.quiet) show("{}: {} runs in {}\n", options.output, report.runs.size(), duration(report.total_seconds));
  return whole ? 0 : exit_interrupted();
}

}  // namespace

void add_report(CLI::App& app, Run& run) {
  CLI::App* command = app.add_subcommand("report", "measure error against run time, as a page with plots");
  const auto options = std::make_shared<ReportOptions>();
  add_input_options(*command, options->input);
  // A report compares what these would choose, and has one camera.
  for (const char* name : {"--error", "--estimator", "--disc-radius", "--no-pyramids", "--cameras"})
    command->remove_option(command->get_option(name));
  const ReportSettings usual;
  command->get_option("--frames")
      ->description(
          fmt::format("end each run after N frames ({}, and {} where sizes differ)", usual.frames, usual.sweep_frames));
  command->get_option("--time")->description("end each run at the first checkpoint after S seconds; 0: no limit (0)");
  command->get_option("--size")->description(
      fmt::format("pixels (as the reference, or as the scene, scaled to at most {} a side)", film_side));
  const char* group = "Report";
  add_text(*command, "-o,--output", options->output, "FILE.html", "the page; .json, .csv and .md are written beside it")
      ->required()
      ->group(group);
  add_text(*command, "--reference", options->reference, "FILE.exr", "from 'parian reference' (made if not given)")
      ->group(group);
  add_text(*command, "--seeds", options->seeds, "N", fmt::format("runs of each configuration ({})", usual.seeds))
      ->group(group);
  command->add_flag("--quiet", options->quiet, "no progress and no summary")->group(group);
  command->footer(
      "Every configuration is rendered with every seed: the poster's uniform disc, exponential radii and Parian's\n"
      "default, each with and without pyramids; then half and twice the layers, their size, and the light maps' size.\n"
      "Ctrl-C, SIGTERM and SIGHUP finish the run under way, write what was measured with whole seeds, or nothing "
      "before\n"
      "there is one, and exit with 130, 143 and 129; a second one ends at once.\n"
      "Example:\n"
      "  parian reference bust.toml --size 128x128 -o reference.exr\n"
      "  parian report bust.toml --reference reference.exr -o report.html");
  command->callback([&run, options] { run = [options] { return run_report(*options); }; });
}

}  // namespace parian
