// How fast a device renders a scene: each pass beside the device's own peak.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "render/renderer.hpp"
#include "scene/scene.hpp"
#include "truth/spread.hpp"

namespace parian {

/// What a pass does that has a natural unit: triangles, texels, evaluations or pixels.
struct BenchPart {
  std::string name, unit;
  double count = 0;       ///< units in one frame
  double operations = 0;  ///< on floating-point numbers, of a unit; as bench_costs.hpp counts
  double bytes = 0;       ///< read and written, of a unit; a lower bound, likewise
  Spread seconds;         ///< of the kernels, in one frame
};

/// One of the four passes, once: as often as a frame has it.
struct BenchPass {
  std::string name;
  Spread wall, kernel;  ///< seconds
  std::vector<BenchPart> parts;
};

struct Bench {
  DeviceInfo device;
  std::uint32_t runs = 0, positions = 0;  ///< positions: subpixel positions that the gather's times are a mean over
  Spread peak;                            ///< floating-point operations per second, of multiply-adds
  std::vector<BenchPass> passes;
  std::uint32_t frames = 0;  ///< of which the last picture is
  double relmse = -1;        ///< that this picture has by its own estimate; negative: not known
  Statistics statistics;
};

/// Measures the device's peak and then `runs` frames of `scene`'s first camera, each with a redraw of the light maps
/// and all levels of the pyramids, after one that isn't counted. The gather is of level 0. Throws as Rendering does.
[[nodiscard]] Bench bench(const Scene& scene, const Settings& settings, const std::string& selector,
                          std::uint32_t runs);

}  // namespace parian
