// What to render and how well: plain structs that the command line, scene files and embedders fill in.
#pragma once
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "scene/mesh.hpp"

namespace parian {

/// Optical coefficients of one homogeneous material, RGB, in 1/mm.
struct Material {
  std::string name;
  glm::dvec3 sigma_s{};  ///< scattering coefficient
  glm::dvec3 sigma_a{};  ///< absorption coefficient
  glm::dvec3 g{};        ///< mean cosine of scattering; 0 when only the reduced coefficient is known
  double ior = 1.3;      ///< index of refraction relative to the outside
};

struct DirectionalLight {
  glm::dvec3 towards{0.5, 0.6, -0.6};                                           ///< to the light; any length > 0
  glm::dvec3 irradiance{std::numbers::pi, std::numbers::pi, std::numbers::pi};  ///< on a surface that faces it
};

/// Pinhole camera; `fov` is the full vertical angle in degrees.
struct Camera {
  glm::dvec3 eye{};
  glm::dvec3 target{};
  glm::dvec3 up{0.0, 1.0, 0.0};
  double fov = 30.0;
};

/// What the host knows of a mesh that lies on the device.
struct MeshBounds {
  std::size_t positions = 0, triangles = 0;  ///< how many
  glm::dvec3 centre{};                       ///< of a sphere that holds them all
  double radius = 0.0;
};

struct Scene {
  Mesh mesh;                              ///< world space, mm; empty if
  std::optional<MeshBounds> on_device{};  ///< this is given
  Material material;
  std::vector<DirectionalLight> lights;
  std::vector<Camera> cameras;
  glm::uvec2 film{512, 512};
};

/// What may be left out, by the names that Settings::keep takes.
inline constexpr std::array omission_names{
    "equal-channels", "black-channels",    "dark-lights", "clipping", "height-pyramids",    "redundant-layers",
    "unread-texels",  "idle-layers",       "layers",      "pyramids", "interior-positions", "checkpoints",
    "camera-redraws", "light-map-redraws",
};

enum class Model { directional, standard, better };
inline constexpr std::array models{Model::directional, Model::standard, Model::better};
inline constexpr std::array<const char*, 3> model_names{"directional", "standard", "better"};
enum class Estimator { automatic, radial, disc };
enum class Gather { automatic, layers, camera };

/// The options of `parian render` that say how well and how; same names, same defaults.
struct Settings {
  double error = 1e-3;          ///< stop when the estimated relMSE is below it twice; 0 never
  std::uint32_t frames = 1024;  ///< cap
  double time = 0.0;            ///< wall seconds from the first frame; 0: no limit
  std::uint32_t layers = 16;
  std::uint32_t layer_size = 256;
  std::uint32_t light_map_size = 512;
  bool light_map_shift = true;
  std::uint32_t samples = 16;  ///< per texel and frame, divided between lights by flux; even
  Model model = Model::directional;
  Estimator estimator = Estimator::automatic;
  double disc_radius = 0.0;  ///< mm; only with Estimator::disc; 0: from the material
  Gather gather = Gather::automatic;
  bool pyramids = true;
  std::uint32_t seed = 0;
  bool still = true;           ///< cameras, film and directions of lights never change once it's planned
  bool time_stages = true;     ///< waits after each stage, so that the wall clock tells stages apart
  std::set<std::string> keep;  ///< names of omissions that are forced off, or "all"
  bool force = false;          ///< try although the device's memory seems too small or its self-test fails
};

/// A linear image, RGBA premultiplied, row by row from the top left.
struct Image {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<float> rgba;
  double estimated_relmse = -1.0;  ///< negative: not known
  /// Standard error of the RGB values, three per pixel; empty: not known, as for every picture the passes make.
  std::vector<float> standard_error{};
};

/// One thing the plan left out: what, why, and what that saved.
struct Omission {
  std::string what;  ///< the name that --keep takes
  std::string why;   ///< one clause
  std::string unit;  ///< of `count`: "evaluations", "bytes", "launches", ...
  double count = 0.0;
  bool estimated = false;  ///< false: counted
};

/// Wall or kernel seconds, by stage.
struct Seconds {
  double load = 0, plan = 0, compile = 0, light_map = 0, layers = 0, pyramids = 0, gather = 0, bias = 0, read = 0;
  double total = 0;
};

/// What a render says of itself; the keys of --stats.
struct Statistics {
  std::uint32_t frames = 0;
  std::string stopped_by;               ///< "error", "frames", "time" or "interrupt"
  double estimated_relmse = -1.0;       ///< negative: not known
  double estimated_bias_relmse = -1.0;  ///< of looking light up in layers; negative: not known
  double evaluations = 0.0;             ///< of S_d, for the pictures
  double bias_evaluations = 0.0;        ///< those that the bias was estimated from
  Seconds seconds;
  Seconds kernel_seconds;
  std::uint32_t layers_count = 0, layers_size = 0;  ///< size: texels along the longer side
  double layers_covered = 0.0;  ///< of the surface seen from outside, or by the cameras whose own views the layers are
  std::uint64_t layers_texels = 0, layers_texels_evaluated = 0;
  std::uint64_t fallback_pixels = 0;
  std::uint64_t bytes_peak = 0;     ///< on the device
  std::uint64_t bytes_planned = 0;  ///< the plan's bound of it
  std::vector<Omission> left_out;
  double further_view_seconds = -1.0;  ///< wall time of each picture after the first; negative: not known
  std::uint64_t nonfinite = 0;
  std::vector<std::string> warnings;
};

}  // namespace parian
