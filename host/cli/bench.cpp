// `parian bench`: how fast this device is at each pass, beside its own peak, as a table or as JSON.
#include "truth/bench.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "cli/driver_guard.hpp"
#include "cli/terminal.hpp"
#include "core/embedded.hpp"
#include "truth/machine.hpp"

namespace parian {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint32_t runs = 5;

struct BenchOptions {
  InputOptions input;
  bool json = false, poster = false;
};

/// What the poster's frame is published with (A. Dal Corso, Real Time Subsurface Scattering, MSc thesis, 2014): its
/// settings, its times by pass, and the peak of its GPU.
struct Published {
  std::uint32_t layers = 16, layer_size = 512, light_map_size = 512, samples = 20;
  std::array<std::pair<const char*, double>, 4> ms{
      {{"light_map", 1.07}, {"layers", 57.59}, {"pyramids", 0.76}, {"gather", 2.56}}};
  double peak = 5e12;  ///< operations per second
};
const Published published;

void set_poster(Settings& settings, const Overrides& overrides) {
  for (const auto& [option, value] : overrides.settings)
    for (const char* name : {"layers", "layer-size", "light-map-size", "samples"})
      if (option->name == name)
        throw Error(ErrorKind::usage, fmt::format("--poster sets --{}; leave one of the two out", name));
  settings.gather = Gather::layers;
  settings.layers = published.layers;
  settings.layer_size = published.layer_size;
  settings.light_map_size = published.light_map_size;
  settings.samples = published.samples;
}

/// A pass, or all of them, beside the poster's: milliseconds, and what each peak could have done in them.
struct PosterRow {
  std::string name;
  double theirs = 0, ours = 0;  ///< ms
  /// How many times the operations that the poster's GPU had time for; below 1 is better.
  [[nodiscard]] double per_peak(const Bench& b) const { return ours * b.peak.median / (theirs * published.peak); }
};

std::vector<PosterRow> poster_rows(const Bench& b) {
  std::vector<PosterRow> rows;
  PosterRow sum{"sum", 0, 0};
  for (const auto& [name, ms] : published.ms)
    for (const BenchPass& pass : b.passes) {
      if (pass.name != name) continue;
      rows.push_back({name, ms, 1e3 * pass.wall.median});
      sum.theirs += ms;
      sum.ours += rows.back().ours;
    }
  rows.push_back(sum);
  return rows;
}

/// A number with three digits and the prefix of its thousands.
std::string with_prefix(double value) {
  const char* prefixes = " kMGT";
  int i = 0;
  while (value >= 999.5 && i < 4) value /= 1000, ++i;
  const int decimals = value < 9.995 ? 2 : value < 99.95 ? 1 : 0;
  return i == 0 ? fmt::format("{:.{}f} ", value, decimals) : fmt::format("{:.{}f} {}", value, decimals, prefixes[i]);
}

std::string milliseconds(const Spread& s) {
  return fmt::format("{:.2f} ({:.2f} to {:.2f})", 1e3 * s.median, 1e3 * s.low, 1e3 * s.high);
}

double per_second(const BenchPart& part) { return part.count / part.seconds.median; }
double share(const BenchPart& part, const Bench& b) { return per_second(part) * part.operations / b.peak.median; }

void print_poster(const Bench& b) {
  show(
      "\nThe poster's frame, published for a GPU of 5 TFLOP/s: 16 layers of 512 x 512, 20 samples, light map of 512 x "
      "512\n{:<12}{:>14}{:>14}{:>30}\n",
      "pass", "its ms", "ms here", "times its operations of peak");
  for (const PosterRow& row : poster_rows(b))
    show("{:<12}{:>14.2f}{:>14.2f}{:>30.2f}\n", row.name, row.theirs, row.ours, row.per_peak(b));
  show(
      "Here a light map is drawn for each of two halves of the samples, and of {} covered texels the {} that the "
      "camera\n"
      "reads are evaluated. The film is what --size says.\n",
      b.statistics.layers_texels, b.statistics.layers_texels_evaluated);
}

void print_table(const Bench& b, const Input& input, const Machine& machine, bool poster) {
  const Statistics& s = b.statistics;
  show("device  {} ({}), driver {}, {} units, {} lanes\n", machine.device, machine.platform, machine.driver,
       machine.compute_units, machine.lanes);
  show("load    {:.1f} before, {:.1f} after\n", machine.load_before[0], machine.load_after[0]);
  show("scene   {} triangles, {}, film {} x {}, {} layers of {} x {}, {} texels read\n",
       input.scene.mesh.triangles.size(), input.scene.material.name, input.scene.film.x, input.scene.film.y,
       s.layers_count, s.layers_size, s.layers_size, s.layers_texels_evaluated);
  show("peak    {}FLOP/s ({} to {}), of multiply-adds\n", with_prefix(b.peak.median), with_prefix(b.peak.low),
       with_prefix(b.peak.high));
  show("error   relMSE {} after {} frames\n\n", b.relmse >= 0 ? fmt::format("{:.2g}", b.relmse) : "unknown", b.frames);
  show("{:<12}{:>28}{:>28}\n", "pass", "ms, wall", "ms, kernels");
  for (const BenchPass& pass : b.passes)
    show("{:<12}{:>28}{:>28}\n", pass.name, milliseconds(pass.wall), milliseconds(pass.kernel));
  show("\n{:<24}{:>25}{:>9}{:>20}{:>10}{:>9}{:>8}{:>7}\n", "of which", "ms, kernels", "count", "a second", "FLOP each",
       "of peak", "B each", "GB/s");
  for (const BenchPass& pass : b.passes)
    for (const BenchPart& part : pass.parts)
      show("{:<24}{:>25}{:>9}{:>20}{:>10.0f}{:>8.1f}%{:>8.1f}{:>7.2f}\n", pass.name + ", " + part.name,
           milliseconds(part.seconds), with_prefix(part.count), with_prefix(per_second(part)) + part.unit,
           part.operations, 100 * share(part, b), part.bytes, 1e-9 * per_second(part) * part.bytes);
  show(
      "\nMedians of {} runs, with least and most. A frame has each pass once; the gather is of level 0, at one "
      "subpixel\n"
      "position (a mean over {}). What is done once a scene took {:.2f} s, and {:.2f} s to compile. FLOP and bytes "
      "are\n"
      "counted in the kernels' source, bytes as a lower bound: those of light maps as if the object filled them, "
      "those\n"
      "of triangles for their set-up, since they are drawn with integers.\n",
      b.runs, b.positions, s.seconds.plan, s.seconds.compile);
  if (poster) print_poster(b);
}

Json json_of(const Spread& s) { return {{"median", s.median}, {"min", s.low}, {"max", s.high}}; }

Json json_of(const BenchPass& pass, const Bench& b) {
  Json json{{"name", pass.name}, {"seconds", json_of(pass.wall)}, {"kernel_seconds", json_of(pass.kernel)}};
  json["parts"] = Json::array();
  for (const BenchPart& part : pass.parts)
    json["parts"].push_back({{"name", part.name},
                             {"unit", part.unit},
                             {"count", part.count},
                             {"kernel_seconds", json_of(part.seconds)},
                             {"per_second", per_second(part)},
                             {"operations_per_unit", part.operations},
                             {"share_of_peak", share(part, b)},
                             {"bytes_per_unit", part.bytes},
                             {"bytes_per_second", per_second(part) * part.bytes}});
  return json;
}

void print_json(const Bench& b, const Input& input, const Machine& machine, bool poster) {
  Json json{{"schema", "parian-bench-1"}, {"version", version}};
  json["device"] = {{"name", machine.device},
                    {"platform", machine.platform},
                    {"driver", machine.driver},
                    {"compute_units", machine.compute_units},
                    {"vector_width", machine.lanes}};
  json["load"] = {{"before", machine.load_before}, {"after", machine.load_after}};
  json["film"] = {input.scene.film.x, input.scene.film.y};
  json["triangles"] = input.scene.mesh.triangles.size();
  json["material"] = input.scene.material.name;
  json["layers"] = {{"count", b.statistics.layers_count},
                    {"size", b.statistics.layers_size},
                    {"texels_evaluated", b.statistics.layers_texels_evaluated}};
  json["peak"] = {{"unit", "floating-point operations per second"}, {"rate", json_of(b.peak)}};
  json["runs"] = b.runs;
  json["subpixel_positions"] = b.positions;
  json["frames"] = b.frames;
  json["estimated_relmse"] = b.relmse >= 0 && std::isfinite(b.relmse) ? Json(b.relmse) : Json(nullptr);
  json["once_seconds"] = {{"plan", b.statistics.seconds.plan}, {"compile", b.statistics.seconds.compile}};
  json["evaluations_per_second"] = nullptr;
  json["passes"] = Json::array();
  for (const BenchPass& pass : b.passes) {
    json["passes"].push_back(json_of(pass, b));
    for (const BenchPart& part : pass.parts)
      if (part.unit == "evaluations" && json["evaluations_per_second"].is_null())
        json["evaluations_per_second"] = per_second(part);
  }
  if (poster) {
    json["poster"] = {{"peak", published.peak}, {"passes", Json::array()}};
    for (const PosterRow& row : poster_rows(b))
      json["poster"]["passes"].push_back({{"name", row.name},
                                          {"published_seconds", 1e-3 * row.theirs},
                                          {"seconds", 1e-3 * row.ours},
                                          {"ratio_per_peak", row.per_peak(b)}});
  }
  show_text(json.dump(2, ' ', true, Json::error_handler_t::replace) + "\n");
}

int run_bench(const BenchOptions& options) {
  const Overrides overrides = options.input.overrides();
  Input input = load_input(options.input.input, overrides);
  FileUses files;
  note_inputs(input, files);
  if (options.poster) set_poster(input.settings, overrides);
  const std::string selector = options.input.device_selector(input.device);
  const std::array<double, 3> load = load_averages();
  guard_drivers();
  const Bench measured = bench(input.scene, input.settings, selector, runs);
  Machine machine = describe_machine(measured.device);
  machine.load_before = load;
  machine.load_after = load_averages();
  options.json ? print_json(measured, input, machine, options.poster)
               : print_table(measured, input, machine, options.poster);
  return 0;
}

}  // namespace

void add_bench(CLI::App& app, Run& run) {
  CLI::App* command = app.add_subcommand("bench", "measure how fast a device is at each pass, beside its own peak");
  const auto options = std::make_shared<BenchOptions>();
  add_input_options(*command, options->input);
  // How many frames is bench's own affair.
  for (const char* name : {"--error", "--frames", "--time", "--cameras"})
    command->remove_option(command->get_option(name));
  const char* group = "Bench";
  command
      ->add_flag("--poster", options->poster,
                 fmt::format("the published frame's settings, beside its times: {} layers of {} x {}, {} samples",
                             published.layers, published.layer_size, published.layer_size, published.samples))
      ->group(group);
  command->add_flag("--json", options->json, "as JSON")->group(group);
  command->footer(
      "Times are medians of five frames, with their range; run nothing else meanwhile. An evaluation is one S_d of "
      "one\n"
      "channel of one pair of points. Operations and bytes are counted in the kernels' source.\n"
      "Example:\n"
      "  parian bench dragon.ply --poster");
  command->callback([&run, options] { run = [options] { return run_bench(*options); }; });
}

}  // namespace parian
