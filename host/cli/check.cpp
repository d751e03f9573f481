// `parian check`: whether a device and its driver compute what they should, as a table or as JSON.
#include "truth/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "cli/driver_guard.hpp"
#include "cli/terminal.hpp"
#include "core/embedded.hpp"

namespace parian {
namespace {

using Json = nlohmann::ordered_json;

struct CheckOptions {
  InputOptions input;  // for the device
  std::string seed, vectors;
  bool json = false, half_space = false;
};

const char* heading(const std::string& section) {
  if (section == "self-test") return "Self-test, as every render starts with it";
  if (section == "random") return "S_d of random pairs of points, float32 on the device against double on the host";
  if (section == "vectors") return "S_d of the vector file's pairs of points";
  if (section == "optical") return "Extreme media";
  if (section == "geometric") return "Extreme meshes";
  if (section == "lighting") return "Extreme lights";
  if (section == "camera") return "Extreme cameras and films";
  if (section == "resource") return "Extreme settings and resources";
  return "Stiff scenes against the reference";
}

/// What was measured beside what was allowed; nothing where there is nothing to measure.
std::string margin(const CheckResult& result) {
  return result.allowed > 0 ? fmt::format("{:9.2g} of {:.2g}", result.error, result.allowed) : "";
}

/// Prints results as they come, under a heading for each section.
class Table {
 public:
  void add(const CheckResult& result) {
    if (result.section != section_) show("\n{}\n", heading(section_ = result.section));
    show("  {}  {:<29} {:<52} {}\n", result.passed ? "ok  " : "FAIL", result.name, result.outcome, margin(result));
    if (!result.passed || result.section == "self-test" || result.section == "random" || result.section == "vectors")
      show("        {}\n", result.found);
    flush_results();
  }

 private:
  std::string section_;
};

std::vector<std::string> failed(const CheckReport& report) {
  std::vector<std::string> names;
  for (const CheckResult& result : report.results)
    if (!result.passed) names.push_back(fmt::format("{}: {}", result.section, result.name));
  return names;
}

double seconds(const CheckReport& report) {
  double sum = 0;
  for (const CheckResult& result : report.results) sum += result.seconds;
  return sum;
}

void print_end(const CheckReport& report) {
  show(
      "\nThe pairs that take most of their tolerance, in hexadecimal; 'parian check --json' keeps them as a vector\n"
      "file, 'parian check --vectors FILE' runs it again\n");
  for (const VectorCase& worst : report.worst) show("  {}\n", vector_json(worst));
  show("\n{} checks on {}, driver {}: {} in {:.1f} s\n", report.results.size(), report.device.name,
       report.device.driver, report.passed() ? "all passed" : fmt::format("{} failed", failed(report).size()),
       seconds(report));
}

void print_json(const CheckReport& report) {
  Json json{{"schema", "parian-check-1"}, {"version", version}};
  json["device"] = {{"name", report.device.name},
                    {"platform", report.device.platform},
                    {"driver", report.device.driver},
                    {"compute_units", report.device.compute_units},
                    {"vector_width", report.device.vector_width}};
  json["seed"] = report.seed;
  json["passed"] = report.passed();
  json["failed"] = failed(report);
  json["seconds"] = seconds(report);
  json["checks"] = Json::array();
  for (const CheckResult& r : report.results)
    json["checks"].push_back({{"section", r.section},
                              {"name", r.name},
                              {"outcome", r.outcome},
                              {"found", r.found},
                              {"error", std::isfinite(r.error) ? Json(r.error) : Json(nullptr)},
                              {"allowed", r.allowed},
                              {"passed", r.passed},
                              {"seconds", r.seconds}});
  json["cases"] = Json::array();  // as in a vector file
  for (const VectorCase& worst : report.worst) json["cases"].push_back(Json::parse(vector_json(worst)));
  show_text(json.dump(2, ' ', true, Json::error_handler_t::replace) + "\n");
}

int run_check(const CheckOptions& options) {
  CheckSettings settings;
  settings.device = options.input.device_selector("");
  if (!options.seed.empty()) settings.seed = parse_whole("--seed", options.seed, 0, largest_whole);
  if (!options.vectors.empty()) FileUses().reads("--vectors", options.vectors);
  if (options.half_space) return print_half_space(options.json);
  guard_drivers();
  Table table;
  if (!options.json) settings.progress = [&](const CheckResult& result) { table.add(result); };
  const CheckReport report =
      options.vectors.empty() ? check_device(settings) : check_vectors(settings, read_vectors(options.vectors));
  options.json ? print_json(report) : print_end(report);
  if (report.passed()) return 0;
  flush_results();
  say(fmt::format("check failed: {}", fmt::join(failed(report), ", ")));
  return 1;
}

}  // namespace

void add_check(CLI::App& app, Run& run) {
  CLI::App* command = app.add_subcommand("check", "check that a device and its driver compute what they should");
  const auto options = std::make_shared<CheckOptions>();
  add_text(*command, "--device", options->input.device, "N|SUBSTRING",
           "device, by number or part of its name; also PARIAN_DEVICE");
  add_text(*command, "--seed", options->seed, "N", "of the random cases (0)");
  add_text(*command, "--vectors", options->vectors, "FILE",
           "instead, judge S_d of the pairs of points in a vector file; numbers may be hexadecimal text");
  command->add_flag("--half-space", options->half_space,
                    "instead, the models' own error: their albedo on a half-space beside a random walk's");
  command->add_flag("--json", options->json, "everything as JSON; it is a vector file of the worst pairs, too");
  command->footer(
      "Everything is compared with double precision on the host, or with what a symmetry or a closed form demands.\n"
      "A case of the random pairs passes within 1e-4 of itself, and 16 times what moving its input by 6e-8 does.\n"
      "Exits 1 if anything fails, and names it.");
  command->callback([&run, options] { run = [options] { return run_check(*options); }; });
}

}  // namespace parian
