// Statistics of error curves, in the logarithms of time and error.
#include "truth/convergence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "truth/plot.hpp"

namespace parian {
namespace {

double error_of(const Checkpoint& checkpoint, Against against) {
  return against == Against::reference ? checkpoint.relmse : checkpoint.sampling_relmse;
}

std::optional<double> seconds_of(const Checkpoint& checkpoint, Timing clock) {
  return clock == Timing::wall ? std::optional(checkpoint.seconds) : checkpoint.kernel_seconds;
}

double resolution(const Report& report, std::uint32_t configuration) {
  return 0.1 * (report.configurations[configuration].limit_relmse + report.reference_relmse.value_or(0.0));
}

/// When one run gets to an error.
struct Arrival {
  double seconds = INFINITY;
  bool extrapolated = false, at_first = false;
};

Arrival arrival(const std::vector<Checkpoint>& points, double error, double bias, Timing clock, Against against) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double e = error_of(points[i], against), t = *seconds_of(points[i], clock);
    if (e > error) continue;
    if (i == 0) return {t, false, true};
    const double before = error_of(points[i - 1], against), start = *seconds_of(points[i - 1], clock);
    if (!(e > 0)) return {t, false, false};
    const double share = std::log(before / error) / std::log(before / e);
    return {start * std::pow(t / start, share), false, false};
  }
  if (points.empty() || bias >= error) return {};
  const double sampling = error_of(points.back(), against) - bias;
  return {*seconds_of(points.back(), clock) * sampling / (error - bias), true, false};
}

}  // namespace

double resolved_bias(const Report& report, std::uint32_t configuration) {
  const double bias = report.configurations[configuration].bias_relmse;
  return bias > resolution(report, configuration) ? bias : 0.0;
}

std::string bias_text(const Report& report, std::uint32_t configuration) {
  const double bias = resolved_bias(report, configuration), least = resolution(report, configuration);
  return bias > 0 || least <= 0 ? power_text(bias) : "< " + power_text(least);
}

std::vector<CurvePoint> curve(const Report& report, std::uint32_t configuration, Timing clock, Against against) {
  std::vector<const ReportRun*> runs;
  std::size_t shared = SIZE_MAX;
  for (const ReportRun& run : report.runs)
    if (run.configuration == configuration) {
      runs.push_back(&run);
      shared = std::min(shared, run.checkpoints.size());
    }
  std::vector<CurvePoint> points;
  for (std::size_t i = 0; !runs.empty() && i < shared; ++i) {
    std::vector<double> seconds, errors;
    for (const ReportRun* run : runs) {
      const auto t = seconds_of(run->checkpoints[i], clock);
      if (!t) return {};
      seconds.push_back(*t);
      errors.push_back(error_of(run->checkpoints[i], against));
    }
    points.push_back({runs.front()->checkpoints[i].frames, spread(seconds), spread(errors)});
  }
  return points;
}

std::optional<double> slope(const std::vector<CurvePoint>& points) {
  const std::size_t count = std::max<std::size_t>(3, (points.size() + 1) / 2);
  if (points.size() < count) return std::nullopt;
  double x = 0, y = 0, xx = 0, xy = 0;
  for (std::size_t i = points.size() - count; i < points.size(); ++i) {
    if (!(points[i].error.median > 0)) return std::nullopt;
    const double u = std::log(points[i].frames), v = std::log(points[i].error.median);
    x += u, y += v, xx += u * u, xy += u * v;
  }
  const auto n = static_cast<double>(count);
  const double spread_of_frames = n * xx - x * x;
  if (!(spread_of_frames > 1e-9)) return std::nullopt;
  return (n * xy - x * y) / spread_of_frames;
}

std::optional<TimeTo> time_to(const Report& report, std::uint32_t configuration, double error, Timing clock,
                              Against against) {
  const double bias = against == Against::reference ? resolved_bias(report, configuration) : 0.0;
  std::vector<Arrival> arrivals;
  for (const ReportRun& run : report.runs) {
    if (run.configuration != configuration) continue;
    for (const Checkpoint& point : run.checkpoints)
      if (!seconds_of(point, clock)) return std::nullopt;
    arrivals.push_back(arrival(run.checkpoints, error, bias, clock, against));
  }
  if (arrivals.empty()) return std::nullopt;
  std::sort(arrivals.begin(), arrivals.end(), [](const Arrival& a, const Arrival& b) { return a.seconds < b.seconds; });
  std::vector<double> seconds;
  for (const Arrival& a : arrivals) seconds.push_back(a.seconds);
  const Arrival &lower = arrivals[(arrivals.size() - 1) / 2], &upper = arrivals[arrivals.size() / 2];
  TimeTo result;
  result.seconds = spread(seconds);
  result.never = !std::isfinite(result.seconds.median);
  result.extrapolated = lower.extrapolated || upper.extrapolated;
  result.at_first = lower.at_first && upper.at_first;
  return result;
}

std::string time_text(double seconds) {
  const auto digits = [](double value, const char* unit) {
    return fmt::format("{:.{}f}\u00a0{}", value, value < 9.95 ? 1 : 0, unit);
  };
  if (!std::isfinite(seconds)) return "never";
  if (seconds < 0.9995) return digits(1e3 * seconds, "ms");
  if (seconds < 119.5) return digits(seconds, "s");
  if (seconds < 7170) return digits(seconds / 60, "min");
  if (seconds < 172000) return digits(seconds / 3600, "h");
  return digits(seconds / 86400, "days");
}

std::string time_text(const TimeTo& time) {
  if (time.never) return "never";
  const char* mark = time.extrapolated ? "≈\u00a0" : time.at_first ? "≤\u00a0" : "";
  return mark + time_text(time.seconds.median);
}

}  // namespace parian
