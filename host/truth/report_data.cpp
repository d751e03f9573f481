// A report as JSON and CSV, and back.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/error.hpp"
#include "truth/report.hpp"

namespace nlohmann {
/// What isn't known is null.
template <>
struct adl_serializer<std::optional<double>> {
  static void to_json(json& j, const std::optional<double>& value) { j = value ? json(*value) : json(nullptr); }
  static void from_json(const json& j, std::optional<double>& value) {
    value = j.is_null() ? std::nullopt : std::optional(j.get<double>());
  }
};
}  // namespace nlohmann

namespace parian {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Configuration, name, options, bias_relmse, limit_relmse, limit_frames)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Comparing, title, option, configurations, values)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Checkpoint, frames, seconds, kernel_seconds, evaluations, relmse, sampling_relmse,
                                   estimated_relmse)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ReportRun, configuration, seed, setup_seconds, compile_seconds, checkpoints)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Picture, caption, width, height, png)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PictureRow, title, pictures)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Machine, cpu, system, device, platform, driver, opencl, version, cores,
                                   compute_units, lanes, load_before, load_after)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Report, input, date, command, scene, reference_name, reference_relmse, pixels, film,
                                   seeds, material, model, triangles, lights, difference_scale, total_seconds, machine,
                                   standard, configurations, comparisons, runs, pictures, warnings)

namespace {

constexpr const char* schema = "parian-report-1";

/// A CSV field: quoted where a comma, a quote or a line's end is inside.
std::string field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

std::string field(const std::optional<double>& value) { return value ? fmt::format("{}", *value) : std::string(); }

}  // namespace

std::string report_json(const Report& report) {
  nlohmann::json json = report;
  json["schema"] = schema;
  return json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

Report read_report(const std::string& json) {
  try {
    const nlohmann::json parsed = nlohmann::json::parse(json);
    if (parsed.at("schema") == schema) return parsed.get<Report>();
  } catch (const nlohmann::json::exception&) {  // told below
  }
  throw Error(ErrorKind::input,
              fmt::format("this isn't a report of the schema {}; make one with 'parian report'", schema));
}

std::string report_csv(const Report& report) {
  std::string csv =
      "configuration,options,seed,frames,seconds,kernel_seconds,evaluations,relmse,sampling_relmse,estimated_relmse,"
      "bias_relmse,setup_seconds,compile_seconds\n";
  for (const ReportRun& run : report.runs) {
    const Configuration& c = report.configurations[run.configuration];
    for (const Checkpoint& p : run.checkpoints)
      csv += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}\n", field(c.name), field(c.options), run.seed,
                         p.frames, p.seconds, field(p.kernel_seconds), p.evaluations, p.relmse, p.sampling_relmse,
                         field(p.estimated_relmse), c.bias_relmse, run.setup_seconds, run.compile_seconds);
  }
  return csv;
}

}  // namespace parian
