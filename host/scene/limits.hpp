// What may be given, each limit once: scene files, the command line and the C API ask here, and say where it was given.
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "scene/scene.hpp"

namespace parian {

/// Numbers from `least` to `most`, with these unless it says so.
struct Interval {
  double least, most;
  bool above = false, below = false;  ///< without `least`, without `most`

  /// False for NaN.
  [[nodiscard]] bool holds(double x) const {
    return (above ? x > least : x >= least) && (below ? x < most : x <= most);
  }
  /// "a number from 0 to 5", as remedies say it.
  [[nodiscard]] std::string text() const;
};

inline constexpr double no_limit = std::numeric_limits<double>::max();

/// Coefficients in 1/mm: beyond, their squares leave the range of float32.
inline constexpr Interval coefficient_limit{0, 1e15};
inline constexpr double least_reduced = 1e-15;  ///< of sigma_s (1 - g) + sigma_a
inline constexpr Interval g_limit{-1, 1}, ior_limit{0, 100, true};
/// Sums of products with it stay in float32.
inline constexpr Interval irradiance_limit{0, 1e30};
/// Full vertical angles, degrees.
inline constexpr Interval fov_limit{0, 180, true, true};
/// Largest length in a scene file, in mm: positions must survive single precision.
inline constexpr double largest_length = 1e9;
inline constexpr Interval length_limit{0, largest_length, true}, scale_limit{0, 1e9, true};
/// Largest side of the film, in pixels.
inline constexpr std::uint32_t largest_film_side = 16384;
/// Most stops of exposure up or down.
inline constexpr double largest_stops = 100.0;
/// A year, in seconds.
inline constexpr Interval time_limit{0, 365.0 * 86400.0};

/// A setting that is a whole number, which `step` divides.
struct WholeSetting {
  const char* name;
  std::uint32_t Settings::*member;
  std::uint32_t least, most, step = 1;

  [[nodiscard]] bool holds(double x) const;
  /// "an even number from 2 to 8"
  [[nodiscard]] std::string text() const;
};
inline constexpr std::uint32_t largest_whole = std::numeric_limits<std::uint32_t>::max();
inline constexpr std::array whole_settings{
    WholeSetting{"frames", &Settings::frames, 1, largest_whole},
    WholeSetting{"layers", &Settings::layers, 1, 1024},
    WholeSetting{"layer_size", &Settings::layer_size, 1, 16384},
    WholeSetting{"light_map_size", &Settings::light_map_size, 1, 16384},
    WholeSetting{"samples", &Settings::samples, 2, 1U << 20, 2},
    WholeSetting{"seed", &Settings::seed, 0, largest_whole},
};

/// A setting that is any number.
struct NumberSetting {
  const char* name;
  double Settings::*member;
  Interval limit;
};
inline constexpr std::array number_settings{
    NumberSetting{"error", &Settings::error, {0, no_limit}},
    NumberSetting{"time", &Settings::time, time_limit},
    NumberSetting{"disc_radius", &Settings::disc_radius, {0, largest_length}},
};

/// What is wrong, with what to do, and the value that it is about by the name that scene files give it.
struct Problem {
  std::string field, what;
  [[nodiscard]] std::string text() const { return field + " " + what; }
};

/// The first problem, if there is one. Settings are looked at one by one.
[[nodiscard]] std::optional<Problem> problem_of(const Material& material);
[[nodiscard]] std::optional<Problem> problem_of(const DirectionalLight& light);
[[nodiscard]] std::optional<Problem> problem_of(const Camera& camera);
[[nodiscard]] std::optional<Problem> problem_of(const Settings& settings);

/// Throws Error(input) naming the field, prefixed by `place`, unless S_d can be computed for every channel.
void validate(const Material& material, const std::string& place);

/// Throw Error(input) for what no picture can be made with; lights and cameras are numbered from 1.
void check_bounds(const MeshBounds& bounds);
void check_lights(const std::vector<DirectionalLight>& lights);
void check_cameras(const std::vector<Camera>& cameras, glm::uvec2 film);

/// Throws Error(usage) for names that nothing has which may be left out.
void check_kept(const Settings& settings);
/// Throws Error(usage) for more samples than can be told apart.
void check_samples(const Settings& settings);

}  // namespace parian
