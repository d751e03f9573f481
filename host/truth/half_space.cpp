// Albedo of a half-space: photons in one dimension, and the plane integral of a dipole.
#include "truth/half_space.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <random>
#include <thread>
#include <vector>

#include "core/error.hpp"
#include "kernels/bssrdf.h"

namespace parian {
namespace {

constexpr double pi = std::numbers::pi;
constexpr std::uint64_t block_size = 4096;       // photons that share a generator
constexpr std::uint32_t longest_walk = 1000000;  // collisions
constexpr double least_weight = 0.5;  // below it photons are absorbed as a whole, by chance: the best of 0.01 to 1

/// Fresnel's unpolarised reflectance from the cosine on the near side; `ratio` is index far / near.
double reflectance(double cosine, double ratio) {
  const double sine_sq = (1 - cosine * cosine) / (ratio * ratio);
  if (sine_sq >= 1) return 1;
  const double far = std::sqrt(1 - sine_sq);
  const double s = (cosine - ratio * far) / (cosine + ratio * far), p = (ratio * cosine - far) / (ratio * cosine + far);
  return (s * s + p * p) / 2;
}

/// Uniform numbers in (0, 1], of which a block of photons has its own.
class Uniform {
 public:
  Uniform(std::uint64_t seed, std::uint64_t block) {
    const auto low = [](std::uint64_t x) { return static_cast<std::uint32_t>(x); };
    std::seed_seq words{low(seed), low(seed >> 32), low(block), low(block >> 32)};
    engine_.seed(words);
  }
  double operator()() { return static_cast<double>((engine_() >> 11) + 1) * 0x1p-53; }

 private:
  std::mt19937_64 engine_;
};

/// The cosine to the normal after a collision. The azimuth never matters in a half-space lit evenly.
double scatter(double mu, double g, Uniform& uniform) {
  if (std::abs(g) < 1e-6) return 2 * uniform() - 1;  // where the closed form below cancels
  const double f = (1 - g * g) / (1 - g + 2 * g * uniform());
  const double turn = std::clamp((1 + g * g - f * f) / (2 * g), -1.0, 1.0);
  const double azimuth = std::cos(2 * pi * uniform());
  const double across = std::sqrt(std::max((1 - mu * mu) * (1 - turn * turn), 0.0));
  return std::clamp(mu * turn + across * azimuth, -1.0, 1.0);
}

/// What became of one photon, or the sum over many.
struct Fate {
  double escaped = 0, absorbed = 0, inside = 0, squared = 0;  // squared: of what escaped
  void add(const Fate& f) { escaped += f.escaped, absorbed += f.absorbed, inside += f.inside, squared += f.squared; }
};

/// One photon of weight 1 that has entered with cosine `mu` to the inward normal.
Fate follow(const HalfSpace& medium, double mu, Uniform& uniform) {
  const double sigma_t = medium.sigma_s + medium.sigma_a;
  const double absorbed_share = medium.sigma_a / sigma_t, scattered_share = medium.sigma_s / sigma_t;
  Fate fate;
  double depth = 0, weight = 1;  // depth in mean free paths
  for (std::uint32_t collision = 0; collision < longest_walk; ++collision) {
    depth -= mu * std::log(uniform());
    if (depth < 0) {
      if (uniform() > reflectance(-mu, 1 / medium.eta)) {
        fate.escaped = weight;
        return fate;
      }
      depth = -depth;  // what is left of the free path, mirrored
      mu = -mu;
    }
    if (weight > least_weight) {
      fate.absorbed += weight * absorbed_share;
      weight *= scattered_share;
    } else if (uniform() <= absorbed_share) {
      fate.absorbed += weight;
      return fate;
    }
    mu = scatter(mu, medium.g, uniform);
  }
  fate.inside = weight;
  return fate;
}

void check_parameters(const HalfSpace& m, double cos_outside, std::uint64_t photons) {
  const auto fail = [](const char* what, double value, const char* expected) {
    throw Error(ErrorKind::input, fmt::format("half-space: {} is {}; give {}", what, value, expected));
  };
  const auto in = [](double x, double low, double high) { return x >= low && x <= high; };
  if (!in(m.sigma_s, 0, 1e15)) fail("sigma_s", m.sigma_s, "a number from 0 to 1e15");
  if (!in(m.sigma_a, 0, 1e15)) fail("sigma_a", m.sigma_a, "a number from 0 to 1e15");
  if (!(m.sigma_s + m.sigma_a > 0)) fail("sigma_s + sigma_a", m.sigma_s + m.sigma_a, "it scattering or absorption");
  if (!(std::abs(m.g) < 1)) fail("g", m.g, "a number between -1 and 1");
  if (!in(m.eta, 0.01, 100)) fail("eta", m.eta, "a number from 0.01 to 100");
  if (!(cos_outside > 0 && cos_outside <= 1)) fail("the light's cosine", cos_outside, "a number above 0, at most 1");
  if (photons < 2) fail("the number of photons", static_cast<double>(photons), "2 or more");
}

/// The plane integral's integrand: S_d at a point of exit, the light's plane being y = 0.
double plane_S(const kernels::ExactMedium& medium, const kernels::ExactBoundary& boundary, Model model,
               kernels::real3 w12, double r, double phi) {
  const kernels::real3 normal{0, 0, 1};
  const kernels::DipoleGeometry g =
      kernels::dipole_geometry({r * std::cos(phi), r * std::sin(phi), 0}, w12, normal, normal);
  return exact_bssrdf(model, medium, boundary, g);
}

}  // namespace

RandomWalk random_walk(const HalfSpace& medium, double cos_outside, std::uint64_t photons, std::uint64_t seed,
                       unsigned threads) {
  check_parameters(medium, cos_outside, photons);
  RandomWalk walk;
  walk.entered = 1 - reflectance(cos_outside, medium.eta);
  if (walk.entered <= 0) return walk;  // total reflection
  const double sine_inside = std::sqrt(1 - cos_outside * cos_outside) / medium.eta;
  const double mu = std::sqrt(std::max(1 - sine_inside * sine_inside, 0.0));

  std::vector<Fate> blocks((photons + block_size - 1) / block_size);
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t block = next++; block < blocks.size(); block = next++) {
      Uniform uniform(seed, block);
      Fate sum;
      for (std::uint64_t k = block * block_size; k < std::min((block + 1) * block_size, photons); ++k) {
        Fate fate = follow(medium, mu, uniform);
        fate.squared = fate.escaped * fate.escaped;
        sum.add(fate);
      }
      blocks[block] = sum;
    }
  };
  if (threads == 0) threads = std::max(std::thread::hardware_concurrency(), 1U);
  {
    std::vector<std::jthread> others;
    for (unsigned t = 1; t < threads; ++t) others.emplace_back(work);
    work();
  }
  Fate sum;  // in the blocks' order, so that threads don't show in the last digits
  for (const Fate& block : blocks) sum.add(block);

  const auto n = static_cast<double>(photons);
  walk.escaped = sum.escaped / n;
  walk.absorbed = sum.absorbed / n;
  walk.inside = sum.inside / n;
  walk.standard_error = std::sqrt(std::max(sum.squared / n - walk.escaped * walk.escaped, 0.0) / (n - 1));
  return walk;
}

double dipole_albedo(const ChannelConstants& channel, Model model, double cos_outside) {
  // r = exp(t): the integrand r^2 S falls off exponentially on both sides and is analytic, so even steps converge
  // faster than any power; so do even angles. The ends leave out less than 1e-9.
  constexpr int angles = 64;
  constexpr double step = 1.0 / 16;
  const double reach = 1e11, smallest = 1e-8;
  const kernels::ExactMedium medium = exact_medium(channel, model, 1 / channel.sigma_t_prime);
  const kernels::ExactBoundary boundary = exact_boundary(channel);
  const double sine = std::sqrt(1 - cos_outside * cos_outside);
  const double T12 = kernels::fresnel_transmittance(cos_outside, boundary);
  if (T12 <= 0) return 0;
  const kernels::real3 w12 = kernels::refract_into({sine, 0, cos_outside}, {0, 0, 1}, boundary);

  const double farthest = medium.sigma_tr > 0 ? std::min(50 / medium.sigma_tr + 50, reach) : reach;
  const int steps = static_cast<int>(std::log(farthest / smallest) / step);
  double sum = 0;
  for (int k = 0; k <= steps; ++k) {
    const double r = smallest * std::exp(k * step);
    double ring = 0;
    for (int a = 0; a < angles; ++a) ring += plane_S(medium, boundary, model, w12, r, pi * (a + 0.5) / angles);
    sum += r * r * ring;
  }
  const double integral = sum * step * 2 * pi / angles;
  return T12 * 4 * pi * channel.C_phi_inv * integral;
}

}  // namespace parian
