// Pairs of points and the S_d that a device must find for them: vector files, random cases, and the rule they judge by.
#pragma once
#include <array>
#include <filesystem>
#include <glm/glm.hpp>
#include <limits>
#include <string>
#include <vector>

#include "core/compute.hpp"
#include "scene/medium.hpp"

namespace parian {

/// One channel of one pair of points, as in a vector file: in float, so that host and device see the same input;
/// lengths in the inverse unit of the coefficients; Fresnel factors not included.
struct VectorCase {
  static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

  std::string name;
  float sigma_s = 0, sigma_a = 0, g = 0, eta = 1;
  glm::vec3 x_i{}, w_i{}, n_i{}, x_o{}, n_o{};
  std::array<double, 3> S{unknown, unknown, unknown};  ///< right value, by model; NaN: not known
  std::array<double, 3> tol{unknown, unknown,
                            unknown};  ///< absolute error allowed, by model; NaN: as tolerance() has it

  ChannelConstants channel{};  ///< as derive() left it

  /// Computes `channel` from the coefficients: once, since Fresnel moments take longer than all else here.
  void derive() { channel = channel_constants(sigma_s, sigma_a, g, eta); }
  /// 1e-9 sigma_t'^2 / (4 pi^2): the part of S below which only the absolute error counts.
  [[nodiscard]] double floor() const;
};

/// S_d of a case in double.
[[nodiscard]] double exact_bssrdf(const VectorCase& c, Model model);

/// 1e-4 S + 16 kappa + floor, kappa being the largest change of S when x_o - x_i, w_i, n_i or n_o moves by 6e-8 of its
/// length along an axis.
[[nodiscard]] double tolerance(const VectorCase& c, Model model);

/// `count` cases, the same for the same seed: media and distances (in mean free paths) log-uniform over all that is
/// promised, half of them on flat ground, the others with any pair of normals; every fourth lit at grazing angles,
/// every eighth near index 1, every sixteenth exactly at it.
[[nodiscard]] std::vector<VectorCase> random_vectors(std::size_t count, std::uint32_t seed);

/// Reads a vector file. A number may also be a string with a hexadecimal float; unknown keys are ignored, models that a
/// case has no S for are NaN. Throws Error(input) naming the file and the case.
[[nodiscard]] std::vector<VectorCase> read_vectors(const std::filesystem::path& file);

/// The case as an object of a vector file, with hexadecimal floats.
[[nodiscard]] std::string vector_json(const VectorCase& c);

/// S_d of all cases in float32, by the self-test's program, of which only tests change the source.
[[nodiscard]] std::vector<float> device_bssrdf(Compute& compute, const std::vector<VectorCase>& cases, Model model,
                                               std::uint32_t lanes, const std::string& source = self_test_sources);

/// How `S` stands against the right values: relative errors of the cases with S above their floor, and how much of its
/// tolerance the worst case takes.
struct Judgement {
  static constexpr double median_limit = 1e-6, p999_limit = 5e-5;

  std::size_t cases = 0;    ///< judged: those whose S is known
  std::size_t bad = 0;      ///< not finite, or negative
  std::size_t outside = 0;  ///< farther from right than their tolerance, bad ones included
  double median = 0, p999 = 0, worst_relative = 0;
  double worst_of_tol = 0;  ///< largest error over its tolerance; infinite for bad ones
  std::size_t worst = 0;    ///< the case that has it

  [[nodiscard]] bool passed() const {
    return cases > 0 && outside == 0 && median <= median_limit && p999 <= p999_limit;
  }
};
[[nodiscard]] Judgement judge(const std::vector<VectorCase>& cases, const std::vector<float>& S, Model model);

}  // namespace parian
