// The plain form of S_d (plain_dipole.cl) and the library's own over the same pairs of points, for the test that they
// agree and for the benchmark of their speed.
#pragma once
#include <array>
#include <cmath>
#include <fstream>
#include <glm/glm.hpp>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "core/compute.hpp"
#include "scene/medium.hpp"
#include "source_file.hpp"
#include "test_device.hpp"

namespace parian::test {

inline constexpr std::uint32_t widest = 16;  // lanes: samples come in multiples of it

/// Red, green and blue of something like skin: a factor of ten in absorption, lengths of a mean free path or so.
inline std::array<ChannelConstants, 3> evaluation_channels() {
  return {channel_constants(0.74, 0.032, 0.0, 1.3), channel_constants(0.88, 0.17, 0.0, 1.3),
          channel_constants(1.01, 0.48, 0.0, 1.3)};
}

/// Samples (x_i, w_i, n_i) as nine arrays, points (x_o, n_o) as six numbers each; sample i * stride is the first of
/// point i.
struct Evaluations {
  std::uint32_t n_points = 0, n_samples = 0, stride = 0;
  std::vector<float> samples, points;
  [[nodiscard]] std::uint32_t all_samples() const { return static_cast<std::uint32_t>(samples.size() / 9); }
};

/// Draws points at a distance of `least` to `most`, log-uniform, from samples near the origin; normals within 60
/// degrees of z and light from above the surface, so that most pairs are lit from the front.
class PairSource {
 public:
  explicit PairSource(std::uint32_t seed) : engine_(seed) {}
  [[nodiscard]] glm::dvec3 on_cone(double least_z) {
    const double z = uniform(least_z, 1), phi = uniform(0, 2 * std::numbers::pi), s = std::sqrt(1 - z * z);
    return {s * std::cos(phi), s * std::sin(phi), z};
  }
  [[nodiscard]] std::array<glm::dvec3, 3> sample() {
    const glm::dvec3 n = on_cone(0.5);
    glm::dvec3 w = on_cone(-1);
    while (glm::dot(w, n) < 0.1) w = on_cone(-1);
    return {on_cone(-1) * 1e-3, w, n};
  }
  [[nodiscard]] std::array<glm::dvec3, 2> point(double least, double most) {
    const double r = std::exp(uniform(std::log(least), std::log(most)));
    return {glm::normalize(on_cone(-1) * glm::dvec3(1, 1, 0.3)) * r, on_cone(0.5)};
  }

 private:
  double uniform(double a, double b) { return a + (b - a) * (double(engine_()) / 4294967296.0); }
  std::mt19937 engine_;
};

/// `n_points` points and `n_samples` samples that all of them share; or, with 0 samples, one sample for each point,
/// repeated in every lane.
inline Evaluations make_evaluations(std::uint32_t n_points, std::uint32_t n_samples, std::uint32_t seed) {
  Evaluations e{n_points, n_samples > 0 ? n_samples : widest, n_samples > 0 ? 0 : widest, {}, {}};
  const std::uint32_t all = n_samples > 0 ? n_samples : n_points * widest;
  PairSource source(seed);
  e.samples.resize(std::size_t{9} * all);
  std::array<glm::dvec3, 3> sample{};
  for (std::uint32_t j = 0; j < all; ++j) {
    if (n_samples > 0 || j % widest == 0) sample = source.sample();
    for (std::uint32_t k = 0; k < 9; ++k) e.samples[k * all + j] = static_cast<float>(sample[k / 3][int(k % 3)]);
  }
  for (std::uint32_t i = 0; i < n_points; ++i)
    for (const glm::dvec3& v : source.point(0.1, 5))
      e.points.insert(e.points.end(), {float(v.x), float(v.y), float(v.z)});
  return e;
}

/// One form of S_d, compiled and with its input on the device.
class EvaluationKernel {
 public:
  /// The library's form at a width, or the plain one for 0, in groups of up to `group` work-items.
  EvaluationKernel(const std::string& selector, std::uint32_t lanes, const Evaluations& e, std::size_t group = 64)
      : evaluations_(e), plain_(lanes == 0), shared_(built_form(selector, lanes)), compute_(*shared_) {
    compute_.limit_groups(group);
    std::vector<float> plain;
    std::vector<kernels::Medium> media;
    for (const ChannelConstants& c : evaluation_channels()) {
      const double s = c.sigma_t_prime, sigma_t = s / (3 * std::sqrt(c.a_back));
      for (const double v : {sigma_t, 1 / (3 * s), c.sigma_tr * s, c.d_e / s, c.z_v / s, c.C_phi, c.C_E, c.C_phi_inv})
        plain.push_back(static_cast<float>(v));
      media.push_back(device_medium(c, Model::directional, 1));
    }
    media_ = plain_ ? compute_.upload(plain) : compute_.upload(media);
    samples_ = compute_.upload(e.samples);
    points_ = compute_.upload(e.points);
    sums_ = compute_.buffer<float>(std::size_t{3} * e.n_points);
  }

  /// Sums of S_d over all samples, three channels for each point. Adds the kernel's seconds to `seconds`.
  std::vector<float> run(double& seconds) {
    const double before = kernel_seconds();
    const cl_uint n = evaluations_.n_points, samples = evaluations_.n_samples, stride = evaluations_.stride,
                  all = evaluations_.all_samples();
    const float eta = static_cast<float>(evaluation_channels()[0].eta);
    if (plain_)
      compute_.launch("plain_dipole", n, Stage::plan, n, samples, stride, all, media_, eta, samples_, points_, sums_);
    else
      compute_.launch("library_dipole", n, Stage::plan, n, samples, stride, all, media_,
                      device_boundary(exact_boundary(eta)), samples_, points_, sums_);
    compute_.finish();
    seconds += kernel_seconds() - before;
    return compute_.read<float>(sums_, std::size_t{3} * n);
  }
  [[nodiscard]] const DeviceInfo& info() const { return compute_.info(); }

 private:
  static std::shared_ptr<Compute> built_form(const std::string& selector, std::uint32_t lanes) {
    std::ifstream file(source_file(lanes == 0 ? "tests/plain_dipole.cl" : "tests/library_dipole.cl"));
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    return built("-cl-std=CL1.2 -DVW=" + std::to_string(lanes == 0 ? 8 : lanes), selector,
                 lanes == 0 ? text : with_headers(text));
  }
  [[nodiscard]] double kernel_seconds() {
    const auto& by_stage = compute_.kernel_seconds();
    return by_stage.empty() ? 0.0 : by_stage.at(Stage::plan);
  }
  const Evaluations& evaluations_;
  bool plain_;
  std::shared_ptr<Compute> shared_;
  Compute& compute_;
  cl::Buffer media_, samples_, points_, sums_;
};

}  // namespace parian::test
