// Statistics as JSON: the keys that others rely on, in one order.
#include "session/statistics.hpp"

#include <nlohmann/json.hpp>

#include "core/embedded.hpp"

namespace parian {
namespace {

using Json = nlohmann::ordered_json;

Json known(double value) { return value >= 0 ? Json(value) : Json(nullptr); }

Json stages(const Seconds& seconds) {
  return {{"load", seconds.load},           {"plan", seconds.plan},     {"compile", seconds.compile},
          {"light_map", seconds.light_map}, {"layers", seconds.layers}, {"pyramids", seconds.pyramids},
          {"gather", seconds.gather},       {"bias", seconds.bias},     {"read", seconds.read},
          {"total", seconds.total}};
}

Json omissions(const std::vector<Omission>& left_out) {
  Json list = Json::array();
  for (const Omission& omission : left_out) {
    list.push_back(
        {{"what", omission.what},
         {"why", omission.why},
         {"saves", {{"unit", omission.unit}, {"count", omission.count}, {"estimated", omission.estimated}}}});
  }
  return list;
}

}  // namespace

Json statistics_json(const Statistics& statistics, const DeviceInfo& device, const glm::uvec2& film) {
  Json json;
  json["schema"] = "parian-stats-1";
  json["version"] = version;
  json["device"] = {{"name", device.name},
                    {"platform", device.platform},
                    {"driver", device.driver},
                    {"compute_units", device.compute_units},
                    {"vector_width", device.vector_width}};
  json["film"] = {film.x, film.y};
  json["frames"] = statistics.frames;
  json["stopped_by"] = statistics.stopped_by.empty() ? Json(nullptr) : Json(statistics.stopped_by);
  json["estimated_relmse"] = known(statistics.estimated_relmse);
  json["estimated_bias_relmse"] = known(statistics.estimated_bias_relmse);
  json["evaluations"] = statistics.evaluations;
  json["bias_evaluations"] = statistics.bias_evaluations;
  json["seconds"] = stages(statistics.seconds);
  json["kernel_seconds"] = stages(statistics.kernel_seconds);
  for (const char* host_only : {"load", "compile", "read"}) json["kernel_seconds"].erase(host_only);
  json["layers"] = {{"count", statistics.layers_count},
                    {"size", statistics.layers_size},
                    {"covered", statistics.layers_covered},
                    {"texels", statistics.layers_texels},
                    {"texels_evaluated", statistics.layers_texels_evaluated}};
  json["further_view_seconds"] = known(statistics.further_view_seconds);
  json["fallback_pixels"] = statistics.fallback_pixels;
  json["bytes"] = {{"peak", statistics.bytes_peak}, {"planned", statistics.bytes_planned}};
  json["left_out"] = omissions(statistics.left_out);
  json["nonfinite"] = statistics.nonfinite;
  json["warnings"] = statistics.warnings;
  return json;
}

}  // namespace parian
