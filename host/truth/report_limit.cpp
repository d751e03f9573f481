// Making limits, and measuring the distance from them.
#include "truth/report_limit.hpp"

#include <algorithm>
#include <cmath>

#include "session/rendering.hpp"
#include "session/warnings.hpp"

namespace parian {
namespace {

constexpr std::uint32_t limit_factor = 4;  // frames of each half of a limit, in those of the longest run

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
  limit.variance = compare(limit.image, limit.image, reference).reference_relmse;
  limit.frames = 2 * limit_factor * frames;
  return limit;
}

}  // namespace parian
