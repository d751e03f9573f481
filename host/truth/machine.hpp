// The machine under a report.
#pragma once
#include <array>

#include "core/device.hpp"
#include "truth/report.hpp"

namespace parian {

/// All but the load averages; "unknown" or 0 where the system doesn't say.
[[nodiscard]] Machine describe_machine(const DeviceInfo& device);
/// Of 1, 5 and 15 minutes; negative where the system doesn't say.
[[nodiscard]] std::array<double, 3> load_averages();

}  // namespace parian
