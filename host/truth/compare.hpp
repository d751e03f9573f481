// How far a picture is from its reference: the measures that every figure of error in Parian is given in.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "scene/scene.hpp"

namespace parian {

/// What `compare` measures, over M = the pixels with alpha >= fully_covered in both pictures and over RGB unless said
/// otherwise; I is the picture, R the reference, eps = 0.01 x mean of R (relative_error.hpp). Squared errors are less
/// the pictures' own variances, where those are known, and at least 0.
struct Comparison {
  std::uint64_t pixels = 0;            ///< of M
  double rmse = 0;                     ///< root of the mean of (I - R)^2
  double relmse = 0;                   ///< mean of (I - R)^2 / (R^2 + eps^2)
  double relmse_uncorrected = 0;       ///< the same with the pictures' own variances left in
  double relmse_p99 = 0;               ///< relmse without the worst 1 % of M
  double relmse_edge = -1;             ///< over pixels covered in part in either picture; negative: there are none
  double reference_relmse = -1;        ///< mean of the reference's own variance / (R^2 + eps^2); negative: not known
  std::array<double, 3> mean_ratio{};  ///< mean of I / mean of R, by channel; 1 where both are 0
  double max_abs = 0;                  ///< largest |I - R|
  std::array<std::uint32_t, 2> max_pixel{};  ///< x and y of the pixel where that is
};

/// Throws Error(input), naming the pictures only as "the picture" and "the reference", when their sizes differ, M is
/// empty, or a value isn't finite.
[[nodiscard]] Comparison compare(const Image& picture, const Image& reference);
/// The same, but R in R^2 + eps^2 is of a third picture, which M needs to be covered in as well: errors to several
/// references then are in one measure.
[[nodiscard]] Comparison compare(const Image& picture, const Image& reference, const Image& relative_to);

/// Each pixel's part in relmse_uncorrected: the mean over RGB of (I - R)^2 / (R^2 + eps^2); negative outside M. Throws
/// as compare does.
[[nodiscard]] std::vector<double> pixel_errors(const Image& picture, const Image& reference);

/// Signed relative error as colour: per channel (I - R) / sqrt(R^2 + eps^2), averaged over RGB, over `scale`; blue
/// where the picture is darker, red where it's brighter, white where they agree, transparent outside M. The same size
/// as the pictures, to be shown without exposure. Throws as compare does.
[[nodiscard]] Image signed_difference(const Image& picture, const Image& reference, double scale);

}  // namespace parian
