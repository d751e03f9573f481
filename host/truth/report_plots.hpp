// The plots and tables of a report.
#pragma once
#include <string>

#include "truth/convergence.hpp"
#include "truth/report.hpp"

namespace parian {

/// Errors that the tables ask the time to, as relMSE.
inline constexpr double target_errors[] = {0.1, 0.01, 0.001};
inline constexpr const char* target_names[] = {"10 %", "1 %", "0.1 %"};

/// Error against time of the methods, or of a sweep's sizes.
[[nodiscard]] std::string report_plot(const Report& report, std::size_t comparison, Timing clock, Against against);
/// Time to each error of the configurations compared.
[[nodiscard]] std::string time_table(const Report& report, std::size_t comparison, Timing clock);
/// Costs of all configurations, and how well each one's own estimate did.
[[nodiscard]] std::string cost_table(const Report& report);

/// Mean cost of one frame, wall seconds, and what a gather takes on top of it; medians over the seeds.
struct FrameCost {
  double frame = 0, gather = 0;
};
[[nodiscard]] std::optional<FrameCost> frame_cost(const Report& report, std::uint32_t configuration);

}  // namespace parian
