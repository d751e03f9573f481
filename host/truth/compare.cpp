// Mean squared errors over the pixels that both pictures cover.
#include "truth/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.hpp"
#include "core/relative_error.hpp"

namespace parian {
namespace {

/// The pixels that count, and what their squared errors are relative to.
struct Common {
  std::vector<std::size_t> covered, edge;
  RelativeTo relative{0};
};

void check_finite(const Image& image, const char* name) {
  for (const auto* values : {&image.rgba, &image.standard_error})
    for (const float v : *values)
      if (!std::isfinite(v)) {
        throw Error(ErrorKind::input, fmt::format("{} has a value that isn't finite; make the picture again", name));
      }
}

Common common_pixels(const Image& picture, const Image& reference, const Image& relative_to) {
  if (picture.width != reference.width || picture.height != reference.height) {
    throw Error(ErrorKind::input,
                fmt::format("the picture has {}x{} pixels and the reference {}x{}; give both the same --size",
                            picture.width, picture.height, reference.width, reference.height));
  }
  check_finite(picture, "the picture");
  check_finite(reference, "the reference");
  if (&relative_to != &reference) check_finite(relative_to, "what errors are relative to");
  Common common;
  double sum = 0;
  for (std::size_t i = 0; i < picture.rgba.size() / 4; ++i) {
    const float a = picture.rgba[4 * i + 3], b = reference.rgba[4 * i + 3];
    if (std::min({a, b, relative_to.rgba[4 * i + 3]}) >= fully_covered) {
      common.covered.push_back(i);
      for (int c = 0; c < 3; ++c) sum += static_cast<double>(relative_to.rgba[4 * i + c]);
    } else if (std::max(a, b) > 0.0F) {
      common.edge.push_back(i);
    }
  }
  if (common.covered.empty()) {
    throw Error(ErrorKind::input,
                "no pixel is covered fully by the object in both pictures; compare pictures of the same camera");
  }
  common.relative = RelativeTo(sum, 3.0 * static_cast<double>(common.covered.size()));
  return common;
}

/// Squared error and own variance of one pixel, both over RGB.
struct PixelError {
  double squared = 0, relative = 0;            ///< mean of (I-R)^2, and of that over R^2 + eps^2
  double variance = 0, relative_variance = 0;  ///< likewise of what both pictures say of themselves
  double reference_variance = 0;               ///< relative, of the reference alone
};

double variance_at(const Image& image, std::size_t i, int c) {
  if (image.standard_error.empty()) return 0.0;
  const double e = image.standard_error[3 * i + c];
  return e * e;
}

PixelError pixel_error(const Image& picture, const Image& reference, const Image& relative_to, const Common& common,
                       std::size_t i) {
  PixelError e;
  for (int c = 0; c < 3; ++c) {
    const double d = static_cast<double>(picture.rgba[4 * i + c]) - static_cast<double>(reference.rgba[4 * i + c]);
    const double norm = common.relative(relative_to.rgba[4 * i + c]);
    if (norm == 0.0) {  // an all-black reference: any light is an infinite relative error
      if (d != 0.0) e.relative = INFINITY;
      e.squared += d * d / 3;
      continue;
    }
    const double of_reference = variance_at(reference, i, c), variance = of_reference + variance_at(picture, i, c);
    e.squared += d * d / 3;
    e.relative += d * d / norm / 3;
    e.variance += variance / 3;
    e.relative_variance += variance / norm / 3;
    e.reference_variance += of_reference / norm / 3;
  }
  return e;
}

}  // namespace

Comparison compare(const Image& picture, const Image& reference) { return compare(picture, reference, reference); }

Comparison compare(const Image& picture, const Image& reference, const Image& relative_to) {
  const Common common = common_pixels(picture, reference, relative_to);
  Comparison result;
  result.pixels = common.covered.size();
  const auto n = static_cast<double>(result.pixels);
  std::array<double, 3> sum{}, reference_sum{};
  std::vector<PixelError> errors;
  errors.reserve(common.covered.size());
  PixelError mean;
  for (const std::size_t i : common.covered) {
    const PixelError e = pixel_error(picture, reference, relative_to, common, i);
    errors.push_back(e);
    mean.squared += e.squared / n;
    mean.relative += e.relative / n;
    mean.variance += e.variance / n;
    mean.relative_variance += e.relative_variance / n;
    mean.reference_variance += e.reference_variance / n;
    for (int c = 0; c < 3; ++c) {
      const double v = picture.rgba[4 * i + c], r = reference.rgba[4 * i + c];
      sum[c] += v;
      reference_sum[c] += r;
      if (std::abs(v - r) > result.max_abs) {
        result.max_abs = std::abs(v - r);
        result.max_pixel = {static_cast<std::uint32_t>(i % picture.width),
                            static_cast<std::uint32_t>(i / picture.width)};
      }
    }
  }
  result.rmse = std::sqrt(std::max(0.0, mean.squared - mean.variance));
  result.relmse_uncorrected = mean.relative;
  result.relmse = std::max(0.0, mean.relative - mean.relative_variance);
  if (!reference.standard_error.empty()) result.reference_relmse = mean.reference_variance;
  for (int c = 0; c < 3; ++c)
    result.mean_ratio[c] = reference_sum[c] != 0.0 ? sum[c] / reference_sum[c] : sum[c] == 0.0 ? 1.0 : INFINITY;

  const std::size_t best = errors.size() - errors.size() / 100;
  std::sort(errors.begin(), errors.end(),
            [](const PixelError& a, const PixelError& b) { return a.relative < b.relative; });
  for (std::size_t i = 0; i < best; ++i)
    result.relmse_p99 += (errors[i].relative - errors[i].relative_variance) / static_cast<double>(best);
  result.relmse_p99 = std::max(0.0, result.relmse_p99);

  if (!common.edge.empty()) {
    result.relmse_edge = 0.0;
    for (const std::size_t i : common.edge) {
      const PixelError e = pixel_error(picture, reference, relative_to, common, i);
      result.relmse_edge += (e.relative - e.relative_variance) / static_cast<double>(common.edge.size());
    }
    result.relmse_edge = std::max(0.0, result.relmse_edge);
  }
  return result;
}

std::vector<double> pixel_errors(const Image& picture, const Image& reference) {
  const Common common = common_pixels(picture, reference, reference);
  std::vector<double> errors(picture.rgba.size() / 4, -1.0);
  for (const std::size_t i : common.covered) errors[i] = pixel_error(picture, reference, reference, common, i).relative;
  return errors;
}

Image signed_difference(const Image& picture, const Image& reference, double scale) {
  const Common common = common_pixels(picture, reference, reference);
  Image image{picture.width, picture.height, std::vector<float>(picture.rgba.size(), 0.0F), -1.0, {}};
  for (const std::size_t i : common.covered) {
    double error = 0;
    for (int c = 0; c < 3; ++c) {
      const double r = reference.rgba[4 * i + c], d = static_cast<double>(picture.rgba[4 * i + c]) - r;
      const double norm = std::sqrt(common.relative(r));
      if (norm > 0.0) error += d / norm / 3;
    }
    const auto t = static_cast<float>(std::clamp(error / scale, -1.0, 1.0));
    image.rgba[4 * i] = t < 0.0F ? 1.0F + t : 1.0F;
    image.rgba[4 * i + 1] = 1.0F - std::abs(t);
    image.rgba[4 * i + 2] = t > 0.0F ? 1.0F - t : 1.0F;
    image.rgba[4 * i + 3] = 1.0F;
  }
  return image;
}

}  // namespace parian
