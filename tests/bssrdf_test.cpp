// bssrdf.h against the vector file, in double on the host and in float32 on the OpenCL device, at two vector widths.
#include "kernels/bssrdf.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "medium.hpp"
#include "test_device.hpp"

namespace parian {
namespace {

using kernels::real3;

constexpr Model models[] = {Model::directional, Model::standard, Model::better};
constexpr const char* model_names[] = {"directional", "standard", "better"};

real3 exactly(glm::vec3 v) { return {v.x, v.y, v.z}; }

/// One channel of one pair of points, as in a vector file; in float, so that host and device see the same input.
struct Case {
  std::string name;
  float sigma_s, sigma_a, g, eta;
  glm::vec3 x_i, w_i, n_i, x_o, n_o;
  double S[3] = {}, tol[3] = {};

  [[nodiscard]] ChannelConstants constants() const { return channel_constants(sigma_s, sigma_a, g, eta); }
  /// 1e-9 sigma_t'^2 / (4 pi^2): the part of S below which only the absolute error counts.
  [[nodiscard]] double floor() const {
    const double sigma = constants().sigma_t_prime / (2 * std::numbers::pi);
    return 1e-9 * sigma * sigma;
  }
  [[nodiscard]] std::string text() const {
    const auto v = [](glm::vec3 a) { return fmt::format("({:a}, {:a}, {:a})", a.x, a.y, a.z); };
    return fmt::format("{}: sigma_s {:a} sigma_a {:a} g {:a} eta {:a} x_i {} w_i {} n_i {} x_o {} n_o {}", name,
                       sigma_s, sigma_a, g, eta, v(x_i), v(w_i), v(n_i), v(x_o), v(n_o));
  }
};

std::vector<Case> vector_file() {
  std::ifstream in(PARIAN_TEST_DATA "/vectors.json");
  const nlohmann::json file = nlohmann::json::parse(in);
  std::vector<Case> cases;
  for (const auto& j : file.at("cases")) {
    const auto vec = [&](const char* key) { return glm::vec3(j[key][0], j[key][1], j[key][2]); };
    Case c{j["name"],  j["sigma_s"], j["sigma_a"], j["g"],     j["eta"],
           vec("x_i"), vec("w_i"),   vec("n_i"),   vec("x_o"), vec("n_o")};
    for (int m = 0; m < 3; ++m) {
      c.S[m] = j["S"][model_names[m]];
      c.tol[m] = j["tol"][model_names[m]];
    }
    cases.push_back(c);
  }
  return cases;
}

double exact(const Case& c, Model model) {
  const real3 n_i = exactly(c.n_i), x = kernels::real3_sub(exactly(c.x_o), exactly(c.x_i));
  const real3 w12 = kernels::refract_into(exactly(c.w_i), n_i, exact_boundary(c.eta));
  const kernels::DipoleGeometry g = kernels::dipole_geometry(x, w12, n_i, exactly(c.n_o));
  const kernels::ExactMedium m = exact_medium(c.constants(), model, 1);
  return model == Model::directional ? kernels::directional_dipole(m, g)
         : model == Model::standard  ? kernels::standard_dipole(m, g)
                                     : kernels::better_dipole(m, g);
}

/// Log-uniform media, distances from 1e-4 to 300 mean free paths; flat surfaces, backlit slabs and any pair of normals.
std::vector<Case> random_cases(int count) {
  std::mt19937 engine(20);
  const auto uniform = [&](double a, double b) { return a + (b - a) * (double(engine()) / 4294967296.0); };
  const auto log_uniform = [&](double a, double b) { return std::pow(10, uniform(a, b)); };
  const auto direction = [&] {
    const double z = uniform(-1, 1), phi = uniform(0, 2 * std::numbers::pi), s = std::sqrt(1 - z * z);
    return glm::dvec3(s * std::cos(phi), s * std::sin(phi), z);
  };
  std::vector<Case> cases;
  for (int i = 0; i < count; ++i) {
    const double sigma = log_uniform(-3, 3), absorbed = log_uniform(-6, -0.05);
    const double g = i % 3 ? 0 : uniform(-0.9, 0.95), r = log_uniform(-4, 2.5) / sigma;
    glm::dvec3 w_i = direction(), x = direction(), n_o = direction();
    w_i.z = std::fabs(w_i.z) + 0.01;
    if (i % 4 < 2) x.z = 0, n_o = {0, 0, 1};
    if (i % 4 == 2) x.z = -std::fabs(x.z), n_o = {0, 0, -1};
    cases.push_back({fmt::format("random {}", i),
                     float(sigma * (1 - absorbed) / (1 - g)),
                     float(sigma * absorbed),
                     float(g),
                     float(uniform(1, 1.6)),
                     glm::vec3(0),
                     glm::normalize(w_i),
                     {0, 0, 1},
                     glm::normalize(x) * r,
                     n_o});
  }
  return cases;
}

/// Inputs where formulas go 0/0 or leave the range of float32.
std::vector<Case> extreme_cases() {
  std::vector<Case> cases;
  const glm::dvec3 directions[] = {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0.6, 0.8, 0}, {-0.6, 0, 0.8}};
  for (const double sigma : {1e-9, 1.0, 1e13})
    for (const double absorbed : {0.0, 1e-7, 0.5, 1.0})
      for (const float eta : {0.5F, 1.0F, 3.0F})
        for (const double r : {0.0, 1e-30, 1e-12, 1e-3, 1.0, 1e4, 1e9})
          for (const glm::dvec3& x : directions)
            for (const glm::dvec3& n_o : directions)
              for (const glm::dvec3& w_i : directions)
                cases.push_back({"extreme",
                                 float(sigma * (1 - absorbed)),
                                 float(sigma * absorbed),
                                 0,
                                 eta,
                                 glm::vec3(0),
                                 w_i,
                                 {0, 0, 1},
                                 x * (r / sigma),
                                 n_o});
  return cases;
}

/// Work-item i evaluates, with the medium of case i, its own geometry in lane i % VW and those of its neighbours in
/// the other lanes.
const char* const evaluate_kernel = R"(
#define SET(v, lane, value) (((float*)&(v))[lane] = (value))
real3 load(__global const float* restrict v, uint first, uint count, uint id) {
  real3 r;
  for (uint lane = 0; lane < VW; ++lane) {
    const uint c = (id - id % VW + lane) % count;
    SET(r.x, lane, v[15 * c + first]);
    SET(r.y, lane, v[15 * c + first + 1]);
    SET(r.z, lane, v[15 * c + first + 2]);
  }
  return r;
}
__kernel void evaluate(__global const Medium* restrict media, __global const Boundary* restrict boundaries,
                       __global const float* restrict vectors, uint count, __global float* restrict S) {
  const uint id = (uint)get_global_id(0);
  if (id >= count) return;
  const real3 n_i = load(vectors, 6, count, id);
  const real3 w12 = refract_into(load(vectors, 3, count, id), n_i, boundaries[id]);
  const real3 x = real3_sub(load(vectors, 9, count, id), load(vectors, 0, count, id));
  const real result = bssrdf(media[id], dipole_geometry(x, w12, n_i, load(vectors, 12, count, id)));
  S[id] = ((const float*)&result)[id % VW];
}
)";

/// S of every case in float32.
std::vector<float> evaluate(TestDevice& device, const std::vector<Case>& cases, Model model, int width) {
  std::vector<kernels::Medium> media;
  std::vector<kernels::Boundary> boundaries;
  std::vector<float> vectors;
  for (const Case& c : cases) {
    media.push_back(device_medium(c.constants(), model, 1));
    boundaries.push_back(boundary(c.eta));
    for (const glm::vec3& v : {c.x_i, c.w_i, c.n_i, c.x_o, c.n_o}) vectors.insert(vectors.end(), {v.x, v.y, v.z});
  }
  return device.run(evaluate_kernel, fmt::format("-DMODEL={} -DVW={}", static_cast<int>(model), width), "evaluate",
                    cases.size(), cases.size(),
                    {device.buffer(media), device.buffer(boundaries), device.buffer(vectors)});
}

/// How far `S` is from `truth`; relative errors only of cases above their floor.
struct Errors {
  double median = 0, p999 = 0, worst_relative = 0, worst_of_tol = 0;
  std::size_t bad = 0;  ///< not finite, or negative
  std::string worst_case, worst_of_tol_case;
};
Errors compare(const std::vector<Case>& cases, const std::vector<float>& S, const std::vector<double>& truth,
               int model) {
  Errors e;
  std::vector<double> relative;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const Case& c = cases[i];
    const double error = std::fabs(double(S[i]) - truth[i]);
    if (!std::isfinite(S[i]) || S[i] < 0) {
      ++e.bad;
      continue;
    }
    if (truth[i] > c.floor()) relative.push_back(error / truth[i]);
    if (truth[i] > c.floor() && relative.back() > e.worst_relative)
      e.worst_relative = relative.back(), e.worst_case = c.text();
    if (c.tol[model] > 0 && error / c.tol[model] > e.worst_of_tol)
      e.worst_of_tol = error / c.tol[model], e.worst_of_tol_case = c.text();
  }
  std::sort(relative.begin(), relative.end());
  const auto quantile = [&](double q) {
    return relative.empty() ? 0.0 : relative[static_cast<std::size_t>(std::ceil(q * double(relative.size() - 1)))];
  };
  e.median = quantile(0.5);
  e.p999 = quantile(0.999);
  return e;
}

TEST(Bssrdf, DoubleFormAgreesWithTheVectorFile) {
  const std::vector<Case> cases = vector_file();
  ASSERT_GE(cases.size(), 270U);
  // tol holds 16 times the change of S when inputs move by 6e-8; double rounds 5e8 times finer.
  for (int m = 0; m < 3; ++m)
    for (const Case& c : cases) EXPECT_LE(std::fabs(exact(c, models[m]) - c.S[m]), 1e-9 * c.tol[m]) << c.text();
}

/// Model and vector width.
class BssrdfOnDevice : public testing::TestWithParam<std::tuple<int, int>> {
 protected:
  const int model_ = std::get<0>(GetParam());
  const int width_ = std::get<1>(GetParam());
  TestDevice device_;

  Errors errors(const std::vector<Case>& cases, const std::vector<double>& truth) {
    Errors e = compare(cases, evaluate(device_, cases, models[model_], width_), truth, model_);
    fmt::print(
        "{} VW={}: {} cases, relative error median {:.2g}, 99.9 % {:.2g}, worst {:.2g}; worst of tol {:.2g}\n"
        "  {}\n",
        model_names[model_], width_, cases.size(), e.median, e.p999, e.worst_relative, e.worst_of_tol, e.worst_case);
    return e;
  }
};

TEST_P(BssrdfOnDevice, AgreesWithTheVectorFile) {
  const std::vector<Case> cases = vector_file();
  std::vector<double> truth;
  for (const Case& c : cases) truth.push_back(c.S[model_]);
  const Errors e = errors(cases, truth);
  EXPECT_EQ(e.bad, 0U);
  EXPECT_LE(e.worst_of_tol, 1) << e.worst_of_tol_case;
  EXPECT_LE(e.median, 1e-6);  // the rule that a device passes by
  EXPECT_LE(e.p999, 5e-5) << e.worst_case;
}

TEST_P(BssrdfOnDevice, AgreesWithTheDoubleFormOnRandomCases) {
  const std::vector<Case> cases = random_cases(20000);
  std::vector<double> truth;
  for (const Case& c : cases) truth.push_back(exact(c, models[model_]));
  const Errors e = errors(cases, truth);
  EXPECT_EQ(e.bad, 0U);
  EXPECT_LE(e.median, 1e-6);
  EXPECT_LE(e.p999, 5e-5) << e.worst_case;
}

TEST_P(BssrdfOnDevice, IsFiniteAndNotNegativeInExtremeCases) {
  const std::vector<Case> cases = extreme_cases();
  const std::vector<float> S = evaluate(device_, cases, models[model_], width_);
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const double truth = exact(cases[i], models[model_]);
    ASSERT_TRUE(std::isfinite(truth) && truth >= 0) << cases[i].text();
    ASSERT_TRUE(std::isfinite(S[i]) && S[i] >= 0) << cases[i].text();
    // The device's max() turns NaN into 0.
    if (truth > 1e6 * cases[i].floor()) {
      ASSERT_GT(S[i], 0) << cases[i].text();
    }
  }
}

TEST_P(BssrdfOnDevice, ScalesExactlyWithPowersOfTwo) {
  const std::vector<Case> cases = vector_file();
  std::vector<Case> scaled = cases;
  const float k = 64;
  for (Case& c : scaled) {
    c.sigma_s *= k, c.sigma_a *= k;
    c.x_i /= k, c.x_o /= k;
  }
  const std::vector<float> S = evaluate(device_, cases, models[model_], width_);
  const std::vector<float> S_scaled = evaluate(device_, scaled, models[model_], width_);
  for (std::size_t i = 0; i < cases.size(); ++i)
    if (S[i] > std::numeric_limits<float>::min()) {
      EXPECT_EQ(S_scaled[i], k * k * S[i]) << cases[i].text();
    }
}

INSTANTIATE_TEST_SUITE_P(ModelsAndWidths, BssrdfOnDevice,
                         testing::Combine(testing::Range(0, 3), testing::Values(1, 8)));

TEST(Bssrdf, ComparisonFailsForNaN) {
  const std::vector<Case> cases = random_cases(2);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(compare(cases, {nan, -1.0F}, {1, 1}, 0).bad, 2U);
}

}  // namespace
}  // namespace parian
