// The pictures of a report: the whole film and its telling parts, each beside the reference and with its signed error.
#pragma once
#include <string>
#include <vector>

#include "truth/report.hpp"

namespace parian {

/// A picture at a checkpoint.
struct Shot {
  Image image;
  double seconds = 0;
  std::uint32_t frames = 0;
  double relmse = 0;
};

/// A method's pictures, in the order of time.
struct MethodShots {
  std::string name;
  bool standard = false;  ///< Parian's default
  std::vector<Shot> shots;
};

/// Relative error at which the false colours saturate.
inline constexpr double difference_scale = 0.2;

/// Rows of pictures: reference, then picture and signed error of each method at the checkpoint whose time is nearest
/// to that of the default's last. First the whole film, then the part with the largest error of the default and one
/// with a typical one, as far as parts are covered well enough. Throws as compare does.
[[nodiscard]] std::vector<PictureRow> picture_rows(const Image& reference, const std::vector<MethodShots>& methods);

}  // namespace parian
