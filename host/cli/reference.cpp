// `parian reference`: the independent answer, batch by batch, continued from an earlier picture if asked.
#include "truth/reference.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <memory>

#include "cli/commands.hpp"
#include "cli/driver_guard.hpp"
#include "cli/interrupt.hpp"
#include "cli/progress.hpp"
#include "cli/terminal.hpp"
#include "scene/limits.hpp"
#include "scene/medium.hpp"
#include "session/warnings.hpp"

namespace parian {
namespace {

struct ReferenceOptions {
  InputOptions input;
  std::vector<std::string> outputs;
  std::string error, time, seed, exposure;
  bool resume = false, quiet = false;
};

constexpr std::uint32_t rays_per_batch = 1U << 19;

ReferenceSettings parse_settings(const ReferenceOptions& options) {
  ReferenceSettings settings;
  if (!options.error.empty()) settings.target = parse_in_range("--error", options.error, {0, no_limit});
  if (!options.time.empty()) settings.time = parse_in_range("--time", options.time, time_limit);
  if (!options.seed.empty()) settings.seed = parse_whole("--seed", options.seed, 0, largest_whole);
  return settings;
}

/// The output that can be continued.
std::filesystem::path resumable(const ReferenceOptions& options) {
  for (const std::string& output : options.outputs)
    if (std::filesystem::path(output).extension() == ".exr") return output;
  throw Error(ErrorKind::usage, "--resume: none of the outputs keeps the standard error; add -o FILE.exr");
}

/// A count in a note, or 0 for what is none.
std::uint32_t count_of(const std::string& note) {
  std::uint32_t count = 0;
  const char* end = note.data() + note.size();
  const auto [stop, fault] = std::from_chars(note.data(), end, count);
  return fault == std::errc() && stop == end ? count : 0;
}

/// The state in an earlier picture, or a new one where there is none.
ReferenceState earlier_state(const std::filesystem::path& path, const std::string& wanted, glm::uvec2 film,
                             std::uint32_t samples) {
  if (!std::filesystem::exists(path)) return {};
  const auto notes = read_notes(path);
  const auto note = [&](const char* name) {
    const auto at = notes.find(name);
    return at == notes.end() ? std::string() : at->second;
  };
  if (note("fingerprint").empty() || note("batches").empty() || note("samples").empty()) {
    throw Error(ErrorKind::input, fmt::format("{}: --resume: is no picture that 'parian reference' made; give another "
                                              "-o, or leave --resume out to replace it",
                                              path.string()));
  }
  if (note("fingerprint") != wanted) {
    throw Error(ErrorKind::input,
                fmt::format("{}: --resume: was made of another scene, camera, film, material, light or "
                            "model; give the same options, or another -o",
                            path.string()));
  }
  const auto refuse = [&](const std::string& what) {
    throw Error(ErrorKind::input, fmt::format("{}: --resume: {}", path.string(), what));
  };
  const Image image = read_image(path);
  if (image.width != film.x || image.height != film.y)
    refuse(fmt::format("has {}x{} pixels, where the film has {}x{}; give another -o", image.width, image.height, film.x,
                       film.y));
  if (count_of(note("samples")) > samples)
    refuse(fmt::format("batches of a film of {}x{} have at most {} camera rays per pixel, not {:.20}; give another -o",
                       film.x, film.y, samples, note("samples")));
  try {
    return reference_state(image, count_of(note("batches")), count_of(note("samples")));
  } catch (const Error& error) {
    refuse(error.what());
  }
  return {};
}

void write_outputs(const ReferenceOptions& options, const Input& input, const ReferenceSettings& settings,
                   const ReferenceState& state, const Exposure& exposure, const std::string& mark) {
  const Image image = reference_image(state);
  PictureNotes notes;
  notes.settings = fmt::format("reference material={} model={}", input.scene.material.name,
                               model_names[static_cast<std::size_t>(settings.model)]);
  notes.estimated_relmse = image.estimated_relmse;
  notes.other = {{"batches", fmt::format("{}", state.batches)},
                 {"samples", fmt::format("{}", state.samples)},
                 {"fingerprint", mark}};
  for (const std::string& output : options.outputs) write_image(output, image, notes, exposure);
}

int run_reference(const ReferenceOptions& options) {
  guard_drivers();  // modules are loaded after them
  const Clock clock;
  ReferenceSettings settings = parse_settings(options);
  const auto exposure = options.exposure.empty() ? Exposure() : parse_exposure(options.exposure);
  if (!exposure) {
    throw Error(ErrorKind::usage, fmt::format("--exposure: '{}' isn't understood; give stops from {} to {}, or auto",
                                              options.exposure, -largest_stops, largest_stops));
  }
  if (options.outputs.empty()) throw Error(ErrorKind::usage, "no output is given; add -o FILE, such as -o truth.exr");
  for (const std::string& output : options.outputs) check_output(output);
  const Input input = load_input(options.input.input, options.input.overrides());
  FileUses files;
  note_inputs(input, files);
  for (const std::string& output : options.outputs) {
    check_output(output, input.scene.film);
    files.writes("-o", output);
  }
  settings.model = input.settings.model;
  const std::uint32_t pixels = input.scene.film.x * input.scene.film.y;
  settings.samples = std::clamp(rays_per_batch / pixels, 1U, settings.samples);  // no batch of a large film takes hours
  Warnings warnings(input.scene.mesh.warnings, input.mesh_file);
  for (const auto& some : {input.scene.mesh.warnings, doubts_of(input.scene.material, optics_of(input.scene.material))})
    for (const std::string& line : warnings.add(some)) say("warning: " + line);
  const std::string mark = fingerprint(input.scene, settings.model);
  ReferenceState state =
      options.resume ? earlier_state(resumable(options), mark, input.scene.film, settings.samples) : ReferenceState();
  const std::uint32_t resumed = state.batches;

  const Stopping ends{.error = settings.target, .time = settings.time};  // batches aren't counted
  listen_for_interrupt();
  {
    ProgressBar bar(!options.quiet, "batch");
    const Clock rendering;
    render_reference(input.scene, settings, state, [&](std::uint32_t batches, double error) {
      bar.update(progress_of(ends, batches, error, rendering.seconds()));
      return !interrupted();
    });
  }
  if (state.batches < least_batches)
    say(fmt::format("warning: {} batches are few for a standard error; add --resume to go on", state.batches));
  if (state.batches > resumed || options.outputs.size() > 1)
    write_outputs(options, input, settings, state, options.exposure.empty() ? input.exposure : *exposure, mark);
  if (!options.quiet) {
    const double error = own_relmse(state);
    show("{}: {} batches of {} samples in {}, own relMSE {}\n", fmt::format("{}", fmt::join(options.outputs, ", ")),
         state.batches, state.samples, duration(clock.seconds()),
         error >= 0 ? fmt::format("{:.2g}", error) : "unknown");
  }
  return interrupted() ? exit_interrupted() : 0;
}

}  // namespace

void add_reference(CLI::App& app, Run& run) {
  CLI::App* command =
      app.add_subcommand("reference", "the same picture by Monte Carlo in double precision, on the host");
  const auto options = std::make_shared<ReferenceOptions>();
  add_scene_options(*command, options->input);
  add_texts(*command, "-o,--output", options->outputs, "FILE",
            "picture to write: .exr keeps the standard error; repeatable, needed");
  const char* well = "How well";
  add_text(*command, "--error", options->error, "E", "stop when the picture's own relMSE is below E; 0: never (0.0001)")
      ->group(well);
  add_text(*command, "--time", options->time, "S",
           fmt::format("stop after S seconds, but not before {} batches; 0: no limit (0)", fewest_batches))
      ->group(well);
  add_text(*command, "--seed", options->seed, "N", "another seed, another noise (0)")->group(well);
  command->add_flag("--resume", options->resume, "add to FILE if it's there, made of the same scene")->group(well);
  const char* see = "Where and what to see";
  add_text(*command, "--exposure", options->exposure, "STOPS|auto", "brightness of .png and the like (0)")->group(see);
  command->add_flag("--quiet", options->quiet, "no progress and no summary")->group(see);
  command->footer(
      "Shares nothing with 'parian render' but the scene, the camera and the formulas of the dipole: no light map, no\n"
      "layers, and no device. In a scene, [render] says the model only.\n"
      "Ctrl-C, SIGTERM and SIGHUP finish the batch, at least the second, write the pictures and exit with 130, 143 "
      "and\n"
      "129; a second one ends at once, and one that is ignored from the start stays so. --resume goes on from there.\n"
      "Examples:\n"
      "  parian reference dragon.ply -o truth.exr --size 128x128\n"
      "  parian compare dragon.exr truth.exr");
  command->callback([&run, options] { run = [options] { return run_reference(*options); }; });
}

}  // namespace parian
