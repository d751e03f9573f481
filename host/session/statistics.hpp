// What a render says of itself, for files and other programs.
#pragma once
#include <glm/glm.hpp>
#include <nlohmann/json_fwd.hpp>

#include "core/device.hpp"
#include "scene/scene.hpp"

namespace parian {

/// The statistics of a render as JSON, schema "parian-stats-1". Numbers that aren't known are null. Names of devices
/// and files may not be UTF-8: dump it with error_handler_t::replace.
[[nodiscard]] nlohmann::ordered_json statistics_json(const Statistics& statistics, const DeviceInfo& device,
                                                     const glm::uvec2& film);

}  // namespace parian
