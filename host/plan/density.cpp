// G(t) is cumulated from far to near in log space, since exp(-sigma t) leaves any number range, then inverted.
#include "plan/density.hpp"

#include <algorithm>
#include <cmath>

#include "core/same_bits.hpp"
#include "kernels/sampling.h"

namespace parian {
namespace {

constexpr double power = 2.1;          // measured: 2.0 to 2.25 do equally well
constexpr double exponent_range = 80;  // what lies farther below the start is nothing to float32
constexpr int grid_steps = 8192;
constexpr std::uint32_t entries = 1024;

double log_integrand(double log_s, double sigma) { return (2.0 - power) * log_s - sigma * std::exp(log_s); }

/// Simpson's rule for the integral over one step of log s, as a logarithm.
double log_step(double a, double b, double sigma) {
  const double fa = log_integrand(a, sigma), fm = log_integrand(0.5 * (a + b), sigma), fb = log_integrand(b, sigma);
  const double top = std::max({fa, fm, fb});
  return top + std::log((std::exp(fa - top) + 4.0 * std::exp(fm - top) + std::exp(fb - top)) * (b - a) / 6.0);
}

double log_add(double a, double b) {
  const double top = std::max(a, b);
  return top + std::log1p(std::exp(std::min(a, b) - top));
}

}  // namespace

DensityTable density_table(const std::vector<kernels::Medium>& media, double disc_radius) {
  double sigma = INFINITY;  // per object unit
  std::vector<double> sigma_t;
  // Media that don't scatter, or that repeat their neighbour, say nothing of where light goes: whether they are
  // evaluated or left out, samples are the same.
  const bool black = std::all_of(media.begin(), media.end(), [](const auto& m) { return m.scale == 0.0F; });
  for (std::size_t i = 0; i < media.size(); ++i) {
    const kernels::Medium& m = media[i];
    if (m.scale == 0.0F && !black) continue;
    if (i > 0 && same_bits(m, media[i - 1])) continue;
    sigma = std::min(sigma, double{m.sigma_tr} * m.sigma_t_prime);
    sigma_t.push_back(m.sigma_t_prime);
  }
  std::nth_element(sigma_t.begin(), sigma_t.begin() + static_cast<std::ptrdiff_t>(sigma_t.size() / 2), sigma_t.end());
  // The middle channel's D did best for measured materials; a far denser one would fall between the samples.
  const double densest = *std::max_element(sigma_t.begin(), sigma_t.end());
  const double D = 1.0 / (3.0 * std::max(sigma_t[sigma_t.size() / 2], 0.5 * densest));
  // The object's diameter is 2: farther than that nothing can be lit, and a wider density is as good as flat.
  const double h_min = std::min(1.5 * D, 2.0);
  const double rho_max =
      std::min(1.001 * std::sqrt(h_min * h_min + 8.0), h_min + exponent_range / std::max(sigma, 1e-9));
  const double a = std::log(LEAST_H_MIN * h_min * 0.999), b = std::log(rho_max), step = (b - a) / grid_steps;

  std::vector<double> log_G(grid_steps + 1);  // of exp(a + i step)
  double tail = -INFINITY;                    // a little beyond rho_max, so that G is above 0 there
  const double far_end = b + 0.01;
  for (int i = 512; i-- > 0;) {
    const double s0 = b + (far_end - b) * i / 512.0, s1 = b + (far_end - b) * (i + 1) / 512.0;
    tail = log_add(log_step(s0, s1, sigma), tail);
  }
  log_G[grid_steps] = tail;
  for (int i = grid_steps; i-- > 0;)
    log_G[i] = log_add(log_step(a + i * step, a + (i + 1) * step, sigma), log_G[i + 1]);

  DensityTable table;
  table.rho.resize(entries);
  const double low = log_G[grid_steps], spacing = (log_G[0] - low) / (entries - 1);
  int cell = grid_steps - 1;
  for (std::uint32_t e = 0; e < entries; ++e) {
    const double y = low + spacing * e;
    while (cell > 0 && log_G[cell] < y) --cell;
    const double f = std::clamp((y - log_G[cell + 1]) / (log_G[cell] - log_G[cell + 1]), 0.0, 1.0);
    table.rho[e][0] = static_cast<float>(std::exp(a + step * (cell + 1 - f)));
  }
  for (std::uint32_t e = 0; e + 1 < entries; ++e) table.rho[e][1] = table.rho[e][0] - table.rho[e + 1][0];
  auto& p = table.parameters;
  p.log_G_min = static_cast<float>(low);
  p.inverse_step = static_cast<float>(1.0 / spacing);
  p.entries = entries;
  p.h_min = static_cast<float>(h_min);
  // Below 0.1 the radii are flat over the object anyway, and float32 loses them in 1 - exp(-sigma r).
  p.sigma = static_cast<float>(std::max(sigma, 0.1));
  p.radius = static_cast<float>(disc_radius > 0.0 ? disc_radius : std::min(2.0, 8.0 / std::max(sigma, 1e-9)));
  return table;
}

}  // namespace parian
