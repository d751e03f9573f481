// What --stats writes.
#pragma once
#include <glm/glm.hpp>
#include <string>

#include "device.hpp"
#include "scene.hpp"

namespace parian {

/// The statistics of a render as JSON text, schema "parian-stats-1". Numbers that aren't known are null.
[[nodiscard]] std::string statistics_json(const Statistics& statistics, const DeviceInfo& device,
                                          const glm::uvec2& film);

}  // namespace parian
