// How error falls with time: medians and spreads over seeds, slopes, and when an error is reached.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "truth/report.hpp"
#include "truth/spread.hpp"

namespace parian {

enum class Timing { wall, kernel };          ///< seconds by which clock
enum class Against { reference, sampling };  ///< error to the reference, or to the configuration's own limit

/// The bias of a configuration's limit, or 0 where it's lost in the variances of limit and reference: below a tenth of
/// their sum.
[[nodiscard]] double resolved_bias(const Report& report, std::uint32_t configuration);
/// The same as text: a bias that isn't resolved as what it's less than.
[[nodiscard]] std::string bias_text(const Report& report, std::uint32_t configuration);

/// All seeds of a configuration at one checkpoint.
struct CurvePoint {
  std::uint32_t frames = 0;
  Spread seconds, error;
};
/// The checkpoints that every seed reached; empty when the clock isn't known.
[[nodiscard]] std::vector<CurvePoint> curve(const Report& report, std::uint32_t configuration, Timing clock,
                                            Against against);

/// Least-squares slope of log error over log frames, of the medians at the last half of the points, at least three;
/// unknown with fewer, or where the error is 0. Not over seconds: what a gather adds to all of them steepens that.
[[nodiscard]] std::optional<double> slope(const std::vector<CurvePoint>& points);

/// The time to an error. `low` and `high` of `seconds` are infinite where a seed never gets there.
struct TimeTo {
  Spread seconds;
  bool never = false;         ///< for the median: the bias alone is larger
  bool extrapolated = false;  ///< for the median: from the last checkpoint, at slope -1
  bool at_first = false;      ///< for the median: the first checkpoint was already there
};
/// Over the seeds' runs, each interpolated between its checkpoints in the logarithms of both, and past its last one
/// continued with sampling error falling as one over the time down to the configuration's bias. Nothing when the
/// clock isn't known.
[[nodiscard]] std::optional<TimeTo> time_to(const Report& report, std::uint32_t configuration, double error,
                                            Timing clock, Against against);

/// A time for people: three digits at most, as "12 ms", "3.4 s" or "2.1 h".
[[nodiscard]] std::string time_text(double seconds);
/// As "12 s (11 to 14)"; marked with a leading "≈" when extrapolated, "≤" at the first checkpoint.
[[nodiscard]] std::string time_text(const TimeTo& time);

}  // namespace parian
