// The independent answer: the rendering equation with a dipole, by Monte Carlo in double precision on the host.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "scene/scene.hpp"

namespace parian {

/// How long to go on, and from which random numbers.
struct ReferenceSettings {
  Model model = Model::directional;
  double target = 1e-4;  ///< stop when the picture's own relMSE is below it; 0: never
  double time = 0.0;     ///< wall seconds after which it stops too, once there are two batches; 0: no limit
  std::uint64_t seed = 0;
  std::uint32_t samples = 8;   ///< camera rays per pixel in each batch, for a new state; fewer where time is short
  std::uint32_t entries = 16;  ///< places of entry per camera ray, divided between the lights, at least four each
  std::uint32_t threads = 0;   ///< 0: all processors
};

/// A picture in the making: the mean over batches of equal size and the variance of that mean. Kept in double so that
/// batches can be added to an earlier result.
struct ReferenceState {
  std::uint32_t width = 0, height = 0;
  std::uint32_t batches = 0;
  std::uint32_t samples = 0;    ///< camera samples per pixel of each batch
  std::vector<double> mean;     ///< RGBA per pixel, premultiplied
  std::vector<double> squared;  ///< per pixel and RGB: sum over batches of (value - mean)^2
};

/// Fewest batches whose standard error is good enough to stop at a target.
inline constexpr std::uint32_t least_batches = 16;

/// Fewest batches that have a standard error at all: with fewer, nothing ends before its time.
inline constexpr std::uint32_t fewest_batches = 2;

/// Adds batches to `state` (empty at first) of the scene's first camera until `settings` says stop: when its time is
/// over, in the middle of a batch, which is dropped. `progress(batches, own relMSE)` after each may return false to
/// stop early. Either way there are fewest_batches. Throws Error(input) for a scene that can't be rendered.
void render_reference(const Scene& scene, const ReferenceSettings& settings, ReferenceState& state,
                      const std::function<bool(std::uint32_t, double)>& progress = {});

/// Mean over M and RGB of the mean's variance / (R^2 + eps^2), as relMSE counts; negative: not known.
[[nodiscard]] double own_relmse(const ReferenceState& state);

/// The picture with its standard error.
[[nodiscard]] Image reference_image(const ReferenceState& state);

/// Most batches and camera samples that a picture can be said to come from: what adds to them mustn't overflow.
inline constexpr std::uint32_t most_batches = 1U << 30, most_samples = 1U << 16;

/// The state that a picture made by reference_image came from, to single precision. Throws Error(input) unless it can
/// have: two batches or more and at most what's above, values that are finite, alpha from 0 to 1, and a standard error
/// that isn't negative.
[[nodiscard]] ReferenceState reference_state(const Image& image, std::uint32_t batches, std::uint32_t samples);

/// Sixteen hexadecimal digits that differ when anything does that the picture depends on, random numbers apart: mesh,
/// material, lights, first camera, film, model.
[[nodiscard]] std::string fingerprint(const Scene& scene, Model model);

}  // namespace parian
