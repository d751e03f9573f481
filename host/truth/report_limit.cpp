// Making limits, and measuring the distance from them.
#include "report_limit.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rendering.hpp"
#include "warnings.hpp"

namespace parian {
namespace {

constexpr std::uint32_t limit_factor = 4;  // frames of each half of a limit, in those of the longest run

/// Means of (I - L)^2 / (R^2 + eps^2) and of var L / (R^2 + eps^2).
std::pair<double, double> squares(const Image& picture, const Image& limit, const Image& reference) {
  constexpr float covered = 0.999F;
  double sum = 0, count = 0;
  const std::size_t pixels = reference.rgba.size() / 4;
  const auto counts = [&](std::size_t i) {
    return std::min({picture.rgba[4 * i + 3], limit.rgba[4 * i + 3], reference.rgba[4 * i + 3]}) >= covered;
  };
  for (std::size_t i = 0; i < pixels; ++i) {
    if (!counts(i)) continue;
    ++count;
    for (int c = 0; c < 3; ++c) sum += static_cast<double>(reference.rgba[4 * i + c]);
  }
  const double epsilon = 0.01 * sum / (3 * count);
  double squared = 0, variance = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    if (!counts(i)) continue;
    for (int c = 0; c < 3; ++c) {
      const double r = reference.rgba[4 * i + c], e = limit.standard_error[3 * i + c];
      const double d = static_cast<double>(picture.rgba[4 * i + c]) - static_cast<double>(limit.rgba[4 * i + c]);
      const double norm = 3 * count * (r * r + epsilon * epsilon);
      if (!(norm > 0)) continue;  // an all-black reference: compare has judged it
      squared += d * d / norm;
      variance += e * e / norm;
    }
  }
  return {squared, variance};
}

/// The mean of two pictures with seeds of their own; half their difference is its standard error. Made without
/// pyramids: in the limit level 0 is shown.
Image make_limit(const Scene& scene, Settings settings, const std::string& selector, std::uint32_t frames,
                 std::vector<std::string>& warnings) {
  settings.pyramids = false;
  Image halves[2];
  for (Image& half : halves) {
    Rendering renderer(scene, settings, selector);
    ++settings.seed;
    render_frames(renderer, {.frames = frames, .checkpoints = false});
    half = renderer.image(0);
    note_warnings(warnings, renderer.statistics().warnings);
  }
  Image& limit = halves[0];
  for (std::size_t i = 0; i < limit.rgba.size(); ++i) {
    const float a = halves[0].rgba[i], b = halves[1].rgba[i];
    limit.rgba[i] = 0.5F * (a + b);
    if (i % 4 < 3) limit.standard_error.push_back(0.5F * std::abs(a - b));
  }
  return limit;
}

}  // namespace

const Limit& Limits::of(const Settings& settings, std::uint32_t frames, const Scene& scene, const std::string& selector,
                        const Image& reference, std::vector<std::string>& warnings) {
  Limit& limit = made_[{settings.estimator, settings.layers, settings.layer_size, settings.light_map_size}];
  if (limit.frames > 0) return limit;
  limit.image = make_limit(scene, settings, selector, limit_factor * frames, warnings);
  limit.to_reference = compare(limit.image, reference);
  limit.variance = squares(limit.image, limit.image, reference).second;
  limit.frames = 2 * limit_factor * frames;
  return limit;
}

double sampling_relmse(const Image& picture, const Image& limit, const Image& reference) {
  const auto [squared, variance] = squares(picture, limit, reference);
  return std::max(0.0, squared - variance);
}

}  // namespace parian
