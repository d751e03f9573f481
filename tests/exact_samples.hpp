// The samples of pass 2 at a point, in double, and what rounding may change of them.
#pragma once
#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <vector>

#include "kernels/sampling.h"
#include "test_lit.hpp"

namespace parian::test {

/// A sample's distance from its centre and its weight, with what float32 may change of them.
struct Radius {
  double r, weight;
  double r_error, weight_error;  // of r, and of the weight relative to it
  bool maybe_outside = false;    // whether it counts at all is up to rounding
};

inline constexpr double half_ulp = 0x1p-24;

/// Radial density around the nearest lit place (0), exponential radii (1), uniform disc (2).
inline Radius radius_of(const DensityTable& table, int estimator, const kernels::float4& centre, double t) {
  const kernels::Density& d = table.parameters;
  if (estimator == 2)
    return {d.radius * std::sqrt(t), std::numbers::pi * d.radius * d.radius, 4 * half_ulp * d.radius, 4 * half_ulp};
  if (estimator == 1) {
    const double reach = -std::expm1(-double{d.sigma} * d.radius), decay = 1 - (1 - t) * reach;
    const double r = -std::log(decay) / d.sigma,
                 r_error = (3 * half_ulp / decay + 3 * half_ulp * r * d.sigma) / d.sigma;
    return {r, 2 * std::numbers::pi * r * reach / (d.sigma * decay), r_error,
            r_error / std::max(r, r_error) + 4 * half_ulp / decay + 3 * half_ulp / reach};
  }
  // G(rho) = t G(h), r^2 = rho^2 - h^2; rho is linear in log G between entries.
  const double log_t = std::log(t), position = (log_t + centre.w - d.log_G_min) * d.inverse_step;
  const double position_error =
      4 * half_ulp * (std::fabs(log_t) + std::fabs(centre.w) + std::fabs(d.log_G_min)) * d.inverse_step + 1e-4;
  const auto cell = std::size_t(std::clamp(std::floor(position), 0.0, d.entries - 2.0));
  const auto fall = [&](std::size_t c) { return double{table.rho[c][0]} - table.rho[c + 1][0]; };
  const double rho = table.rho[cell][0] - fall(cell) * (position - double(cell));
  const double rho_error = fall(cell) * position_error + 4 * half_ulp * rho;
  const double r2 = std::max(rho * rho - double{centre.z} * centre.z, 0.0), r2_error = 2 * rho * rho_error;
  Radius s{std::sqrt(r2), 0, std::sqrt(r2 + r2_error) - std::sqrt(std::max(r2 - r2_error, 0.0)), 0};
  s.weight = position < 0 ? 0 : 2 * std::numbers::pi * d.inverse_step * fall(cell) * rho / t;
  s.weight_error = rho_error / rho + 6 * half_ulp;
  s.maybe_outside = std::fabs(position) < position_error;
  for (const double side : {-1.0, 1.0}) {  // the slope changes from entry to entry
    const auto other = std::size_t(std::clamp(std::floor(position + side * position_error), 0.0, d.entries - 2.0));
    s.weight_error += std::fabs(fall(other) / fall(cell) - 1);
  }
  return s;
}

/// Sums over samples, and by how much rounding may change them.
struct Replay {
  glm::dvec3 sum{}, allowed{}, absolute{};
  int guided = 0;  // samples that a guide placed and that count
};

/// One light's samples at one point, in double, and what rounding may change of them.
class LightAtPoint {
 public:
  LightAtPoint(const LitBench& bench, int estimator, std::size_t point, std::uint32_t half, std::size_t l)
      : b_(bench),
        estimator_(estimator),
        half_(half),
        light_(b_.passes.light_maps.lights[l]),
        colours_(b_.plan.unit_lights ? b_.passes.light_maps.given[l].irradiance : glm::dvec3(1)),
        view_(light_.view),
        centre_(b_.centres[l * b_.n + point]),
        p_(view_.frame(exact(b_.at[2 * point]) - view_.origin)),
        n_o_(view_.frame(exact(b_.at[2 * point + 1]))),
        of_tile_(b_, l, half, std::bit_cast<std::uint32_t>(b_.at[2 * point + 1].w) ^ 0x40000000U),
        guide_(of_tile_ && centre_.z > 3 * b_.plan.density.parameters.h_min ? &of_tile_ : nullptr),
        axis_(light_.view.centre_x, light_.view.centre_y),
        middle_(centre_.x, centre_.y),
        sample_(light_.sample_x[half], light_.sample_y[half]) {
    const std::uint32_t number = std::bit_cast<std::uint32_t>(b_.at[2 * point].w) ^ 0x40000000U;
    const std::uint32_t scramble = kernels::hash_combine(
        kernels::hash_combine(estimator == 0 ? number / 9 : number, b_.passes.seed), std::uint32_t(2 * l) + half);
    const std::uint32_t of_class = estimator == 0 ? number % 9 : 0;
    hash_u_ = kernels::hash(scramble), shift_u_ = hash_u_ + of_class * CLASS_STEP_U,
    shift_v_ = kernels::hash(scramble ^ 0x68bc21ebU) + of_class * CLASS_STEP_V;
  }

  /// Adds one round. Of rounding: the sample's place, by the change of S_d there; the texel it falls in and the side of
  /// the tangent plane, where either is as good.
  void add(std::uint32_t round, Replay& result) const {
    for (std::uint32_t j = round * light_.samples; j < (round + 1) * light_.samples; ++j) {
      const Drawn d = draw(j);
      const PerMedium f = response(d, d.at, {}, {}, 0);
      const std::vector<PerMedium> others = as_good(d);
      for (int c = 0; c < 3; ++c) {
        const std::size_t m = b_.plan.medium_of[c];
        const double e = exact(light_.irradiance)[c] * double{float(colours_[c])}, value = e * f[m];
        result.sum[c] += value;
        result.absolute[c] += std::fabs(value);
        for (const PerMedium& o : others) result.allowed[c] += e * std::fabs(o[m] - f[m]);
        const double radius_error = d.guided ? 0 : d.radius.maybe_outside ? 1 : d.radius.weight_error;
        result.allowed[c] += (radius_error + (guide_ ? 1e-5 : 0)) * std::fabs(value);
      }
      result.guided += d.guided && f[b_.plan.medium_of[0]] > 0;
    }
  }

 private:
  /// A sample as the sequence has it, and its place in the light's plane.
  struct Drawn {
    bool guided;
    std::uint32_t chosen;
    float t;
    Radius radius;
    glm::dvec2 outwards, at;
  };

  Drawn draw(std::uint32_t j) const {
    const bool guided = guide_ && ((j ^ hash_u_) & 1) == 0;  // every other sample
    const std::uint32_t k = guide_ ? j / 2 : j, other = guided ? 0x3c6ef372U : 0U;
    std::uint32_t u = k * R2_STEP_U + shift_u_, w = k * R2_STEP_V + shift_v_;
    if (estimator_ == 0) {
      std::uint32_t reversed = 0;
      for (int bit = 0; bit < 32; ++bit) reversed |= (k >> bit & 1) << (31 - bit);
      u = reversed + shift_u_ + other, w = reversed * LATTICE_V + shift_v_ + other;
      u = 2 * std::min(u, ~u);  // folded
    }
    const float t = (static_cast<float>(u >> 8) + 0.5F) * 0x1p-24F;
    const double v = double(w >> 8) * 0x1p-24, turn = 2 * std::numbers::pi * v;
    Drawn d{guided, guided ? guide_->place(t) : 0, t, radius_of(b_.plan.density, estimator_, centre_, t), {}, {}};
    d.outwards = {std::cos(turn), std::sin(turn)};
    d.at = guided ? (guide_->film(d.chosen, v) + sample_ - 0.5 - axis_) / double{light_.view.scale}
                  : middle_ + d.radius.r * d.outwards;
    return d;
  }

  /// The inverse density of a sample in a texel; of two samplers, by the balance heuristic.
  double weight(const Drawn& d, glm::dvec2 place, std::size_t texel) const {
    if (!guide_) return d.radius.weight;
    const double scale = light_.view.scale;
    const std::size_t rank = d.guided ? std::size_t(d.chosen / guide_->unit()) : guide_->ranks()[texel];
    const double rho2 = glm::dot(place - middle_, place - middle_) + double{centre_.z} * centre_.z;
    const double fall = b_.plan.density.parameters.sigma * std::sqrt(rho2) + centre_.w + double{1.6556F};
    const double radial = std::exp(-std::min(fall, 80.0)) / rho2;
    const double of_guide = guide_->density(rank) * scale * scale, both = radial + of_guide;
    if (!d.guided) return 2 * d.radius.weight * radial / both;
    const double length = guide_->length(guide_->strip_of(d.t)) / guide_->unit();
    return 2 * of_guide / both * length * double(guide_->strips()) / (scale * scale);
  }

  PerMedium response(const Drawn& d, glm::dvec2 place, glm::dvec2 texel_move, glm::dvec3 move, double n_turn,
                     double n_z2_move = 0) const {
    const LightMaps& maps = b_.passes.light_maps;
    const glm::dvec2 film = place * double{light_.view.scale} + axis_;
    const glm::dvec2 texel = glm::floor(film - sample_ + 0.5 + texel_move);
    if (texel.x < 0 || texel.y < 0 || texel.x >= light_.view.width || texel.y >= light_.view.height) return PerMedium{};
    const auto index = std::size_t(texel.y) * light_.view.width + std::size_t(texel.x);
    MapTexel data(b_.map[light_.map + half_ * maps.size * maps.size + index]);
    data.n.z = std::sqrt(std::max(data.n.z * data.n.z + n_z2_move, 1e-4));
    PerMedium f = texel_response(b_.plan, light_, data, texel + sample_, film, p_ + move, n_o_, n_turn);
    for (double& value : f) value *= weight(d, place, index);
    return f;
  }

  /// The responses that rounding might as well have made.
  std::vector<PerMedium> as_good(const Drawn& d) const {
    const double at_error = d.guided ? 8 * half_ulp : d.radius.r_error;
    const double film_error = at_error * double{light_.view.scale} + 4 * half_ulp * b_.passes.light_maps.size;
    std::vector<PerMedium> others;
    for (const double side : {-1.0, 1.0}) {
      if (d.guided) {
        others.push_back(response(d, d.at + glm::dvec2(side * at_error, 0), {}, {}, 0));
        others.push_back(response(d, d.at + glm::dvec2(0, side * at_error), {}, {}, 0));
      } else {
        others.push_back(response(d, middle_ + std::max(d.radius.r + side * at_error, 0.0) * d.outwards, {}, {}, 0));
      }
    }
    for (int axis_of_move = 0; axis_of_move < 3; ++axis_of_move) {
      glm::dvec3 move{};
      move[axis_of_move] = 6 * half_ulp;  // coordinates up to 1, rounded through frame, film and plane
      others.push_back(response(d, d.at, {}, move, 0));
    }
    for (const double side : {-1.0, 1.0}) {
      others.push_back(response(d, d.at, {side * film_error, 0}, {}, 0));
      others.push_back(response(d, d.at, {0, side * film_error}, {}, 0));
      others.push_back(response(d, d.at, {}, {}, side * 4 * half_ulp));
      others.push_back(response(d, d.at, {}, {}, 0, side * 5 * half_ulp));  // n_i's z^2 is 1 minus squares
    }
    return others;
  }

  const LitBench& b_;
  int estimator_;
  std::uint32_t half_;
  const kernels::Light& light_;
  glm::dvec3 colours_;
  ExactView view_;
  kernels::float4 centre_;
  glm::dvec3 p_, n_o_;
  Guide of_tile_;
  const Guide* guide_;
  glm::dvec2 axis_, middle_, sample_;
  std::uint32_t hash_u_ = 0, shift_u_ = 0, shift_v_ = 0;
};

}  // namespace parian::test
