// Exact albedos of half-spaces, from invariance: what the random walk is tested against.
#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "truth/half_space.hpp"

namespace parian::test {

/// A point of a quadrature rule.
struct Node {
  double x, weight;
};

/// Tanh-sinh rule on [low, high], which minds neither roots nor logarithms at the ends.
inline void add_panel(std::vector<Node>& nodes, double low, double high, double step) {
  for (int k = -static_cast<int>(3.2 / step); k * step <= 3.2; ++k) {
    const double t = step * k, e = std::exp(std::numbers::pi * std::sinh(t));
    nodes.push_back({low + (high - low) * e / (1 + e),
                     (high - low) * step * std::numbers::pi * std::cosh(t) * e / ((1 + e) * (1 + e))});
  }
}

/// Chandrasekhar's H for even scattering with albedo `alpha`, at `mu`, by iteration of 1/H = sqrt(1 - alpha) +
/// alpha/2 int x H(x) / (mu + x) dx (Radiative Transfer, 1950).
inline double chandrasekhar_H(double alpha, double mu) {
  std::vector<Node> nodes;
  add_panel(nodes, 0, 1, 1.0 / 8);
  std::vector<double> H(nodes.size(), 1);
  const auto next = [&](double m) {
    double sum = 0;
    for (std::size_t j = 0; j < nodes.size(); ++j) sum += nodes[j].weight * nodes[j].x * H[j] / (m + nodes[j].x);
    return 1 / (std::sqrt(1 - alpha) + alpha / 2 * sum);
  };
  for (double change = 1; change > 1e-13;) {
    change = 0;
    for (std::size_t i = 0; i < H.size(); ++i) {
      const double better = next(nodes[i].x);
      change = std::max(change, std::abs(better - H[i]));
      H[i] = better;
    }
  }
  return next(mu);
}

/// Reflectance seen from inside the medium, in the textbook form.
inline double inner_reflectance(double mu, double eta) {
  const double sine_sq = eta * eta * (1 - mu * mu);
  if (sine_sq >= 1) return 1;
  const double c = std::sqrt(1 - sine_sq);
  const double s = (eta * mu - c) / (eta * mu + c), p = (mu - eta * c) / (mu + eta * c);
  return (s * s + p * p) / 2;
}

/// The exact answer: a half-space's law of reflection S from Ambartsumian's invariance (nothing changes when a thin
/// layer is added on top), for azimuthal means and Henyey and Greenstein's phase function; then light that the surface
/// throws back is sent in again until none is left.
class ExactHalfSpace {
 public:
  ExactHalfSpace(const HalfSpace& m, const std::vector<double>& angles) : medium_(m) {
    const double critical = m.eta > 1 ? std::sqrt(1 - 1 / (m.eta * m.eta)) : 0;
    if (critical > 0) add_panel(nodes_, 0, critical, 1.0 / 4);
    add_panel(nodes_, critical, 1, 1.0 / 4);
    for (const double angle : angles) {  // where the light is: weight 0, so that S is known there and no sum changes
      const double sine = std::sin(angle * std::numbers::pi / 180) / m.eta;
      nodes_.push_back({std::sqrt(1 - sine * sine), 0});
    }
    first_light_ = nodes_.size() - angles.size();
    fill_phase_functions();
    solve_S();
  }

  /// Share of the flux entering from the k-th angle that escapes.
  [[nodiscard]] double escaped(std::size_t k) const {
    const std::size_t n = nodes_.size();
    const auto up_from = [&](std::size_t i, std::size_t j, double flux) {  // radiance at i for flux coming down at j
      return S_[i * n + j] * flux / (4 * std::numbers::pi * nodes_[i].x * nodes_[j].x);
    };
    std::vector<double> first(n), up(n);
    for (std::size_t i = 0; i < n; ++i) up[i] = first[i] = up_from(i, first_light_ + k, 1);
    for (double change = 1; change > 1e-12;) {
      change = 0;
      for (std::size_t i = 0; i < n; ++i) {
        double value = first[i];
        for (std::size_t j = 0; j < n; ++j)
          value += up_from(i, j,
                           2 * std::numbers::pi * nodes_[j].weight * nodes_[j].x *
                               inner_reflectance(nodes_[j].x, medium_.eta) * up[j]);
        change = std::max(change, std::abs(value - up[i]));
        up[i] = value;
      }
    }
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i)
      sum += 2 * std::numbers::pi * nodes_[i].weight * nodes_[i].x * (1 - inner_reflectance(nodes_[i].x, medium_.eta)) *
             up[i];
    return sum;
  }

 private:
  /// p(mu, mu') and p(mu, -mu'), averaged over azimuth, from Legendre's polynomials.
  void fill_phase_functions() {
    const std::size_t n = nodes_.size();
    const int terms = medium_.g == 0 ? 1 : static_cast<int>(std::log(1e-9) / std::log(std::abs(medium_.g))) + 1;
    same_.assign(n * n, 0), opposite_.assign(n * n, 0);
    std::vector<double> P(n, 1), before(n, 0);
    double weight = 1;
    for (int l = 0; l < terms; ++l, weight *= medium_.g) {
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = 0; j < n; ++j) {
          const double term = (2 * l + 1) * weight * P[i] * P[j];
          same_[i * n + j] += term;
          opposite_[i * n + j] += l % 2 ? -term : term;
        }
      for (std::size_t i = 0; i < n; ++i) {
        const double next = ((2 * l + 1) * nodes_[i].x * P[i] - l * before[i]) / (l + 1);
        before[i] = P[i], P[i] = next;
      }
    }
  }

  /// (1/mu + 1/mu') S = alpha (p_opposite + p_same W S + S W p_same + S W p_opposite W S), W = dmu / (2 mu), iterated
  /// from S = 0.
  void solve_S() {
    const std::size_t n = nodes_.size();
    const double alpha = medium_.sigma_s / (medium_.sigma_s + medium_.sigma_a);
    S_.assign(n * n, 0);
    const auto product = [&](const std::vector<double>& a, const std::vector<double>& b) {  // a W b
      std::vector<double> c(n * n, 0);
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t k = 0; k < n; ++k) {
          const double f = a[i * n + k] * nodes_[k].weight / (2 * nodes_[k].x);
          for (std::size_t j = 0; j < n; ++j) c[i * n + j] += f * b[k * n + j];
        }
      return c;
    };
    for (double change = 1; change > 1e-9;) {
      change = 0;
      std::vector<double> inner = product(opposite_, S_);
      for (std::size_t i = 0; i < n * n; ++i) inner[i] += same_[i];
      const std::vector<double> right = product(S_, inner), left = product(same_, S_);
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = 0; j < n; ++j) {
          const std::size_t at = i * n + j;
          const double value = alpha * (opposite_[at] + left[at] + right[at]) / (1 / nodes_[i].x + 1 / nodes_[j].x);
          change = std::max(change, std::abs(value - S_[at]));
          S_[at] = value;
        }
    }
  }

  HalfSpace medium_;
  std::vector<Node> nodes_;
  std::size_t first_light_ = 0;
  std::vector<double> same_, opposite_, S_;
};

}  // namespace parian::test
