// What a scene needs, decided before anything is compiled: media, lights, build options, memory; and what is left out.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "core/device.hpp"
#include "kernels/types.h"
#include "plan/density.hpp"
#include "plan/views.hpp"
#include "scene/scene.hpp"

namespace parian {

/// A light that takes part, its place in the scene, and the samples that a frame takes of it for each half.
struct PlannedLight {
  DirectionalLight light;
  std::uint32_t number = 0;
  std::uint32_t samples = 0;
};

struct Plan {
  ObjectSpace space;
  std::vector<kernels::Medium> media;        ///< distinct scattering channels, densest last; object units
  std::array<std::uint32_t, 3> medium_of{};  ///< of R, G, B; media.size() where a channel does not scatter
  kernels::Boundary boundary{};
  DensityTable density;
  std::vector<PlannedLight> lights;
  bool dark = false;               ///< no light takes part: `lights` has one without irradiance, which says nothing
  bool unit_lights = false;        ///< what is summed is of lights of irradiance 1, whose colours come last
  Gather gather = Gather::layers;  ///< not automatic any more
  bool clipping = false;
  bool pyramids = true;
  bool height_pyramids = true;     ///< of the light maps
  bool guides = true;              ///< of samples that are far from what is lit
  std::uint32_t records = 1;       ///< set-up records per triangle
  std::uint32_t lanes = 1;         ///< samples side by side in pass 2
  std::uint32_t window = 0;        ///< pixels along a side of what is gathered at once
  std::string options;             ///< of the OpenCL compiler
  std::uint64_t bytes = 0;         ///< upper bound of device memory
  std::uint64_t largest = 0;       ///< largest buffer, bytes
  std::vector<Omission> left_out;  ///< evaluations are counted per frame
  std::vector<std::string> warnings;

  /// Sums that each texel has: one of each light where colours come last, since these differ.
  [[nodiscard]] std::uint32_t sums() const { return unit_lights ? static_cast<std::uint32_t>(lights.size()) : 1; }
  /// Channels that S_d is evaluated for.
  [[nodiscard]] std::uint32_t channels() const { return static_cast<std::uint32_t>(media.size()); }
};

/// Plans a scene for a device. Throws Error(input) when there is nothing to render and Error(device) when the device's
/// memory can't hold it.
/// A mesh on the device whose sphere isn't known yet, radius 0, is planned for as of radius 1.
[[nodiscard]] Plan make_plan(const Scene& scene, const Settings& settings, const DeviceInfo& device);

/// Bytes that the gaps between buffers may take where all are parts of one.
inline constexpr std::uint64_t scratch_slack = 1 << 20;

/// True when `settings` forces the omission `name` off.
[[nodiscard]] bool kept(const Settings& settings, const std::string& name);

/// Lights whose sums are kept one by one, at most.
inline constexpr std::size_t most_sums = 8;

/// Bytes that guides of samples may take, of all lights: many lights have few samples each, and do without.
inline constexpr std::uint64_t most_guides = std::uint64_t{1} << 29;

/// Film windows that are gathered at once, in pixels per side: the largest, and the smallest where memory is short.
inline constexpr std::uint32_t window_limit = 2048, smallest_window = 256;
/// Pixels whose points are held at a time, while pass 2's function computes them directly.
inline constexpr std::uint32_t direct_points = 262144;

// How layers are placed; measured on bodies, CAD parts and a tray: more directions find more of the surface, larger
// films do not.
inline constexpr std::uint32_t candidate_directions = 128;  ///< in opposite pairs, beside the evenly spread ones
inline constexpr std::uint32_t candidate_size = 128;        ///< of their films
inline constexpr std::size_t surface_samples = 16384;       ///< points on which the choice rests
/// Bytes on the device that placing `layers` layers takes for a while.
[[nodiscard]] std::uint64_t sight_bytes(std::uint32_t layers);

/// Bytes that guides take for tiles of all layers, and for maps of so many texels.
[[nodiscard]] std::uint64_t guide_bytes(std::uint64_t lights, std::uint64_t tiles, std::uint64_t texels);

/// Tiles of a layer that share a guide of samples.
[[nodiscard]] std::uint32_t guide_tiles(glm::uvec2 film);

/// First texel of each level of a mip chain over `count` films, and one past the last; levels down to 1 x 1.
[[nodiscard]] std::vector<std::uint32_t> mip_offsets(glm::uvec2 film, std::uint32_t count);

}  // namespace parian
