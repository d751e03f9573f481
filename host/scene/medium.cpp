// Constants of media and boundaries in double: Fresnel moments by quadrature, and measured materials.
#include "scene/medium.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/embedded.hpp"
#include "core/error.hpp"
#include "core/nearest.hpp"

namespace parian {
namespace {

constexpr double pi = std::numbers::pi;

struct Node {
  double x, weight;
};

/// Gauss-Legendre rule on [0, 1]: roots of P_n by Newton from Chebyshev-like starts.
template <int n>
std::array<Node, n> gauss_nodes() {
  std::array<Node, n> nodes{};
  for (int i = 0; i < n; ++i) {
    double x = std::cos(pi * (i + 0.75) / (n + 0.5));
    double slope = 1;
    for (int step = 0; step < 8; ++step) {
      double before = 1, p = x;  // P_{k-1}, P_k
      for (int k = 1; k < n; ++k) before = std::exchange(p, ((2 * k + 1) * x * p - k * before) / (k + 1));
      slope = n * (x * p - before) / (x * x - 1);
      x -= p / slope;
    }
    nodes[static_cast<std::size_t>(i)] = {(1 + x) / 2, 1 / ((1 - x * x) * slope * slope)};
  }
  return nodes;
}

/// F_dr of the standard dipole (Egan and Hilgeman's fit, as Jensen et al. use it), kept where A = (1+F)/(1-F) exists:
/// the fit passes 1 near eta = 3.8 and near 0.25.
double diffuse_reflectance_fit(double eta) {
  const double i = 1 / eta;
  const double fit = eta >= 1 ? ((-1.440 * i + 0.710) * i + 0.668) + 0.0636 * eta
                              : -0.4399 + i * (0.7099 + i * (-0.3319 + i * 0.0636));
  return std::clamp(fit, 0.0, 0.99);
}

glm::dvec3 rgb(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

/// The moments of an index and of its inverse, which all channels share.
struct BothMoments {
  explicit BothMoments(double eta) : at(fresnel_moments(eta)), at_inverse(fresnel_moments(1 / eta)) {}
  FresnelMoments at, at_inverse;
};

ChannelConstants channel_constants(double sigma_s, double sigma_a, double g, double eta, const BothMoments& moments) {
  const double sigma_s_prime = (1 - g) * sigma_s;
  ChannelConstants c;
  c.eta = eta;
  c.sigma_t_prime = sigma_s_prime + sigma_a;
  if (c.sigma_t_prime > 0) {
    c.alpha_prime = sigma_s_prime / c.sigma_t_prime;
    c.absorbed = sigma_a / c.sigma_t_prime;
    const double offset = c.sigma_t_prime / (3 * (sigma_s + sigma_a));
    c.a_back = offset * offset;
  }
  c.C_phi = moments.at.C_phi;
  c.C_E = moments.at.C_E;
  c.C_phi_inv = moments.at_inverse.C_phi;
  c.A = (1 - c.C_E) / (2 * c.C_phi);
  c.sigma_tr = std::sqrt(3 * c.absorbed);
  c.d_e = 2.131 / 3 / std::sqrt(std::max(c.alpha_prime, 1e-6));
  c.z_v = 2 * c.A * c.d_e;
  return c;
}

kernels::ExactBoundary exact_boundary(double eta, double C_phi, double C_E) {
  return {eta * eta, (eta - 1) * (eta + 1), 1 / eta, 3 * C_phi / C_E};
}

}  // namespace

FresnelMoments fresnel_moments(double eta) {
  // With the transmittance T = 1 - R nothing cancels: C_phi = 1/2 int T mu, C_E = 3/2 int T mu^2, where T is 0 up to
  // the critical angle. mu = start + (1 - start) t^2 removes the root there; near eta = 1 the other branch point comes
  // close, hence panels that shrink towards t = 0.
  static const std::array<Node, 20> nodes = gauss_nodes<20>();
  const double inv_sq = 1 / (eta * eta);
  const double critical_sq = (eta - 1) * (eta + 1) * inv_sq;
  const double start = std::sqrt(std::max(critical_sq, 0.0));
  FresnelMoments moments{0, 0};
  constexpr int panels = 12;
  for (int panel = 0; panel < panels; ++panel) {
    const double right = std::ldexp(1.0, -2 * panel);
    const double left = panel + 1 < panels ? right / 4 : 0.0;
    for (const Node& node : nodes) {
      const double t = left + (right - left) * node.x;
      const double above = (1 - start) * t * t;  // mu - start
      const double mu = start + above;
      const double q = std::sqrt(critical_sq > 0 ? above * (mu + start) : mu * mu - critical_sq);
      const double T = 2 * mu * q * (1 / ((mu + q) * (mu + q)) + inv_sq / ((mu * inv_sq + q) * (mu * inv_sq + q)));
      const double weight = node.weight * (right - left) * 2 * (1 - start) * t;
      moments.C_phi += 0.5 * weight * T * mu;
      moments.C_E += 1.5 * weight * T * mu * mu;
    }
  }
  return moments;
}

ChannelConstants channel_constants(double sigma_s, double sigma_a, double g, double eta) {
  return channel_constants(sigma_s, sigma_a, g, eta, BothMoments(eta));
}

Optics optics_of(const Material& material) {
  const BothMoments moments(material.ior);
  Optics optics;
  for (int c = 0; c < 3; ++c)
    optics.channels[static_cast<std::size_t>(c)] =
        channel_constants(material.sigma_s[c], material.sigma_a[c], material.g[c], material.ior, moments);
  optics.boundary = exact_boundary(optics.channels[0]);
  return optics;
}

std::vector<std::string> doubts_of(const Material& material, const Optics& optics) {
  std::vector<std::string> doubts;
  if (material.ior < 1)
    doubts.push_back(fmt::format(
        "material '{}': ior {:g} is below 1, less than the outside has, and shines several times too bright "
        "if it is the inverse of what was meant; give {:.4g} then",
        material.name, material.ior, 1 / material.ior));
  for (std::size_t c = 0; c < 3; ++c) {
    const ChannelConstants& k = optics.channels[c];
    if (k.alpha_prime > 0 && k.alpha_prime < least_diffusive_albedo)
      doubts.push_back(
          fmt::format("material '{}': reduced albedo {:.2f} in channel {} is below {}, where a diffusion model is "
                      "several times too bright",
                      material.name, k.alpha_prime, "RGB"[c], least_diffusive_albedo));
  }
  return doubts;
}

kernels::ExactMedium exact_medium(const ChannelConstants& channel, Model model, double unit) {
  kernels::ExactMedium m{};
  m.sigma_t_prime = channel.sigma_t_prime * unit;
  m.sigma_tr = channel.sigma_tr;
  m.a_back = channel.a_back;
  m.d_e = channel.d_e;
  m.C_E = channel.C_E;
  const double square = m.sigma_t_prime * m.sigma_t_prime;
  const double per_exitance = 1 / (16 * pi * pi * channel.C_phi_inv);  // 1/(4 pi) of diffusion, 1/(4 pi C_phi(1/eta))
  switch (model) {
    case Model::directional:
      m.z_v = channel.z_v;
      m.scale = channel.alpha_prime > 0 ? square * per_exitance * channel.C_E : 0;
      break;
    case Model::standard: {
      const double F = diffuse_reflectance_fit(channel.eta);
      m.z_v = 1 + 4.0 / 3 * (1 + F) / (1 - F);
      m.scale = square * channel.alpha_prime / (4 * pi * pi);
      break;
    }
    case Model::better: {
      const double D = (1 + channel.absorbed) / 3;  // Grosjean
      m.sigma_tr = std::sqrt(channel.absorbed / D);
      m.z_v = 1 + 4 * channel.A * D;
      m.fluence = channel.C_phi / D;
      m.scale = square * channel.alpha_prime * channel.alpha_prime * per_exitance;
      break;
    }
  }
  return m;
}

kernels::Medium device_medium(const ChannelConstants& channel, Model model, double unit) {
  const kernels::ExactMedium m = exact_medium(channel, model, unit);
  const auto f = [](double x) { return static_cast<float>(x); };
  return {f(m.sigma_t_prime), f(m.sigma_tr), f(m.d_e), f(m.z_v), f(m.a_back), f(m.fluence), f(m.C_E), f(m.scale)};
}

kernels::ExactBoundary exact_boundary(double eta) {
  const FresnelMoments inside = fresnel_moments(eta);
  return exact_boundary(eta, inside.C_phi, inside.C_E);
}

kernels::ExactBoundary exact_boundary(const ChannelConstants& channel) {
  return exact_boundary(channel.eta, channel.C_phi, channel.C_E);
}

kernels::Boundary device_boundary(const kernels::ExactBoundary& b) {
  return {static_cast<float>(b.eta_sq), static_cast<float>(b.eta_sq_minus_1), static_cast<float>(b.inverse_eta),
          static_cast<float>(b.fluence)};
}

const std::vector<MeasuredMaterial>& measured_materials() {
  static const std::vector<MeasuredMaterial> materials = [] {
    std::vector<MeasuredMaterial> all;
    for (const MeasuredRow* row = measured_rows; row->name; ++row)
      all.push_back({{row->name, rgb(row->sigma_s), rgb(row->sigma_a), rgb(row->g), row->ior}, row->dataset});
    return all;
  }();
  return materials;
}

Material find_material(const std::string& name) {
  std::vector<std::string> names;
  for (const MeasuredMaterial& row : measured_materials()) {
    if (plain_name(row.material.name) == plain_name(name)) return row.material;
    names.push_back(row.material.name);
  }
  names = nearest_first(name, names);
  throw Error(ErrorKind::input,
              fmt::format("material '{}': not among the measured materials; the nearest names are {}, {} and {}", name,
                          names.at(0), names.at(1), names.at(2)));
}

double exact_bssrdf(Model model, const kernels::ExactMedium& medium, const kernels::ExactBoundary& boundary,
                    const kernels::DipoleGeometry& geometry) {
  switch (model) {
    case Model::standard:
      return kernels::standard_dipole(medium, geometry);
    case Model::better:
      return kernels::better_dipole(medium, geometry);
    case Model::directional:
      break;
  }
  return kernels::directional_dipole(medium, boundary, geometry);
}

}  // namespace parian
