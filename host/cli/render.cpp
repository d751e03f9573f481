// `parian render`: loads, renders until something says stop, writes pictures and statistics.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "cli/driver_guard.hpp"
#include "cli/interrupt.hpp"
#include "cli/progress.hpp"
#include "cli/terminal.hpp"
#include "core/words.hpp"
#include "io/whole_file.hpp"
#include "scene/limits.hpp"
#include "session/rendering.hpp"
#include "session/statistics.hpp"
#include "session/warnings.hpp"

namespace parian {
namespace {

struct RenderOptions {
  InputOptions input;
  std::vector<std::string> outputs;
  std::string exposure, stats;
  bool explain = false, dry_run = false, quiet = false, verbose = false;
};

/// Prints what is new of `more`, and keeps it for the statistics.
void warn(Warnings& warnings, const std::vector<std::string>& more) {
  for (const std::string& line : warnings.add(more)) say("warning: " + line);
}

/// Where a name has "%d" or "%03d": begin, end and the digits asked for; begin == end when it has none.
struct Pattern {
  std::size_t begin = 0, end = 0;
  int digits = 0;
};

Pattern find_pattern(const std::string& name) {
  for (std::size_t i = name.find('%'); i != std::string::npos; i = name.find('%', i + 1)) {
    std::size_t end = i + 1;
    while (end < name.size() && name[end] >= '0' && name[end] <= '9') ++end;
    const std::string digits = name.substr(i + 1, end - i - 1);
    if (end < name.size() && name[end] == 'd' && (digits.empty() || (digits[0] == '0' && digits.size() <= 2))) {
      return {i, end + 1, digits.empty() ? 0 : digits.back() - '0'};
    }
  }
  return {};
}

/// The file of one camera.
std::string numbered(const std::string& name, std::size_t camera) {
  const Pattern pattern = find_pattern(name);
  if (pattern.begin == pattern.end) return name;
  return name.substr(0, pattern.begin) + fmt::format("{:0{}}", camera, pattern.digits) + name.substr(pattern.end);
}

/// Finds what would go wrong after rendering before it.
void check_outputs(const RenderOptions& options) {
  if (options.outputs.empty() && !options.dry_run) {
    throw Error(ErrorKind::usage, "no output is given; add -o FILE, such as -o picture.exr");
  }
  const bool many = !options.input.cameras.empty();
  for (const std::string& output : options.outputs) check_output(many ? numbered(output, 0) : output);
  if (!options.stats.empty()) check_place(options.stats);
}

/// All files that are read and written: none may replace another.
void check_names(const RenderOptions& options, const Input& input) {
  FileUses files;
  note_inputs(input, files);
  const std::size_t cameras = input.scene.cameras.size();
  for (const std::string& output : options.outputs) {
    const Pattern pattern = find_pattern(output);
    if (cameras > 1 && pattern.begin == pattern.end) {
      throw Error(ErrorKind::usage, fmt::format("-o {}: {} cameras would write the same file; give a number in the "
                                                "name, such as picture_%03d.exr",
                                                output, cameras));
    }
    for (std::size_t camera = 0; camera < cameras; ++camera) {
      const std::string name = options.input.cameras.empty() ? output : numbered(output, camera);
      check_output(name, input.scene.film);
      files.writes("-o", name);
    }
  }
  if (!options.stats.empty()) files.writes("--stats", options.stats);
}

/// Renders until something says stop; returns what, as the statistics have it.
std::string render_all(Rendering& renderer, const Settings& settings, bool shown) {
  const CancelToken& cancel = listen_for_interrupt();
  ProgressBar bar(shown);
  return word_of(
      render_frames(renderer, {settings.error, settings.frames, settings.time, &cancel}, [&](const Progress& progress) {
        bar.update(progress);
        keep_listening();
      }));
}

std::vector<std::string> write_images(Rendering& renderer, const Input& input, const RenderOptions& options,
                                      const Exposure& exposure) {
  PictureNotes notes;
  notes.device = renderer.device().name;
  notes.settings = fmt::format("material={} {}", input.scene.material.name, describe(input.settings));
  notes.frames = renderer.frames();
  std::vector<std::string> written;
  const bool many = !options.input.cameras.empty();
  for (std::size_t camera = 0; camera < input.scene.cameras.size(); ++camera) {
    const Image image = renderer.image(camera);
    notes.estimated_relmse = image.estimated_relmse;
    for (const std::string& output : options.outputs) {
      written.push_back(many ? numbered(output, camera) : output);
      write_image(written.back(), image, notes, exposure);
    }
  }
  return written;
}

/// The scene for the renderer. The geometry goes with it, since at millions of triangles each copy counts.
Scene take_scene(Input& input) {
  Mesh& mesh = input.scene.mesh;
  auto positions = std::move(mesh.positions);
  auto triangles = std::move(mesh.triangles);
  auto normals = std::move(mesh.normals);
  Scene scene = input.scene;
  scene.mesh.positions = std::move(positions);
  scene.mesh.triangles = std::move(triangles);
  scene.mesh.normals = std::move(normals);
  return scene;
}

void print_input(const Input& input, const DeviceInfo& device) {
  const MeshCounts& counts = input.scene.mesh.counts;
  say(fmt::format("{} triangles in {} parts, from {} faces; material {}; {} lights; {} cameras", counts.triangles,
                  counts.parts, counts.faces_read, input.scene.material.name, input.scene.lights.size(),
                  input.scene.cameras.size()));
  say(fmt::format("device {}: {} ({}), {} lanes", device.index, device.name, device.platform, device.vector_width));
  say(describe(input.settings));
}

void print_seconds(const Statistics& done) {
  const Seconds& s = done.seconds;
  say(fmt::format(
      "seconds: load {:.3f}, plan {:.3f}, compile {:.3f}, light map {:.3f}, layers {:.3f}, pyramids {:.3f}, "
      "gather {:.3f}, bias {:.3f}, read {:.3f}, total {:.3f}",
      s.load, s.plan, s.compile, s.light_map, s.layers, s.pyramids, s.gather, s.bias, s.read, s.total));
  if (done.further_view_seconds >= 0)
    say(fmt::format("seconds for each view after the first: {:.3f}", done.further_view_seconds));
}

std::string statistics_text(const Statistics& done, const DeviceInfo& device, const glm::uvec2& film) {
  using Json = nlohmann::ordered_json;
  return statistics_json(done, device, film).dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Rendering planned(Input& input, const RenderOptions& options) {
  Compiling compiling(!options.quiet);
  return {take_scene(input), input.settings, options.input.device_selector(input.device), [&] { compiling.step(); }};
}

/// Everything after the input is loaded; fills `done` with what the renderer says and returns the pictures' names.
std::vector<std::string> render_scene(Rendering& renderer, const Input& input, const RenderOptions& options,
                                      const Exposure& exposure, Statistics& done) {
  std::string stopped_by;
  std::vector<std::string> written;
  if (!options.dry_run) {
    stopped_by = render_all(renderer, input.settings, !options.quiet);
    written = write_images(renderer, input, options, exposure);
  }
  done = renderer.statistics();
  done.stopped_by = stopped_by;
  return written;
}

int run_render(const RenderOptions& options) {
  const Clock clock;
  const Overrides overrides = options.input.overrides();
  const auto exposure = options.exposure.empty() ? Exposure() : parse_exposure(options.exposure);
  if (!exposure) {
    throw Error(ErrorKind::usage, fmt::format("--exposure: '{}' isn't understood; give stops from {} to {}, or auto",
                                              options.exposure, -largest_stops, largest_stops));
  }
  check_outputs(options);
  Input input = load_input(options.input.input, overrides);
  check_names(options, input);
  const double loaded = clock.seconds();
  Statistics done;
  std::vector<std::string> written;
  DeviceInfo device;
  Warnings warnings(input.scene.mesh.warnings, input.mesh_file);
  {
    guard_drivers();
    auto renderer = planned(input, options);
    device = renderer.device();
    warn(warnings, input.scene.mesh.warnings);
    warn(warnings, renderer.statistics().warnings);
    if (options.verbose) print_input(input, device);
    if (options.explain || options.dry_run) {
      for (const std::string& line : renderer.explanation()) show("{}\n", line);
      flush_results();  // before hours of rendering
    }
    written = render_scene(renderer, input, options, options.exposure.empty() ? input.exposure : *exposure, done);
  }
  warn(warnings, done.warnings);
  done.warnings = warnings.all();
  done.seconds.load = loaded;
  done.seconds.total = clock.seconds();
  if (!options.stats.empty()) write_text(options.stats, statistics_text(done, device, input.scene.film));
  if (options.verbose) print_seconds(done);
  if (!options.quiet && !options.dry_run) {
    show("{}: {} frames in {}, estimated relMSE {}, stopped by {}\n", fmt::format("{}", fmt::join(written, ", ")),
         done.frames, duration(done.seconds.total),
         done.estimated_relmse >= 0 ? fmt::format("{:.2g}", done.estimated_relmse) : "unknown", done.stopped_by);
  }
  return done.stopped_by == "interrupt" ? exit_interrupted() : 0;
}

}  // namespace

void add_render(CLI::App& app, Run& run) {
  CLI::App* command = app.add_subcommand("render", "render a scene or a mesh");
  const auto options = std::make_shared<RenderOptions>();
  add_input_options(*command, options->input);
  add_texts(*command, "-o,--output", options->outputs, "FILE",
            "picture to write: .exr is linear, .png tone mapped; repeatable, needed");
  const char* see = "Where and what to see";
  add_text(*command, "--exposure", options->exposure, "STOPS|auto", "brightness of .png and the like (0)")->group(see);
  add_text(*command, "--stats", options->stats, "FILE", "write statistics as JSON")->group(see);
  command->add_flag("--explain", options->explain, "print what the scene needs, what was left out and why")->group(see);
  command->add_flag("--dry-run", options->dry_run, "stop after the plan, and print it; needs no -o")->group(see);
  command->add_flag("--quiet", options->quiet, "no progress and no summary")->group(see);
  command->add_flag("--verbose", options->verbose, "more about the input, the device and where the time went")
      ->group(see);
  command->footer(
      "Defaults are in parentheses. In a scene, [render] takes these names with '_' for '-'.\n"
      "A bare mesh is centred; the default light shines from behind, where translucency shows.\n"
      "Ctrl-C, SIGTERM and SIGHUP finish the frame, write the pictures and exit with 130, 143 and 129; a second one "
      "ends\n"
      "at once, and one that is ignored from the start, as under nohup, stays so.\n"
      "Examples:\n"
      "  parian render dragon.ply -o dragon.png --exposure auto\n"
      "  parian render bust.toml -o bust.exr -o bust.png --material skimmilk --error 1e-4\n"
      "  parian render bust.toml -o view_%03d.exr --cameras turntable.toml --stats stats.json");
  command->callback([&run, options] { run = [options] { return run_render(*options); }; });
}

}  // namespace parian
