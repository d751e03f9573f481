// bssrdf.h against the vector file, in double on the host and in float32 on the OpenCL device, at two vector widths.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "render/self_test.hpp"
#include "source_file.hpp"
#include "test_scene.hpp"
#include "truth/vectors.hpp"

namespace parian {
namespace {

using namespace test;

std::vector<VectorCase> vector_file() { return read_vectors(source_file("tests/data/vectors.json")); }

/// Inputs where formulas go 0/0 or leave the range of float32.
const std::vector<VectorCase>& extreme_vectors() {
  static std::vector<VectorCase> cases;
  if (!cases.empty()) return cases;
  int number = 0;
  const glm::dvec3 directions[] = {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0.6, 0.8, 0}, {-0.6, 0, 0.8}};
  for (const double sigma : {1e-9, 1.0, 1e13})
    for (const double absorbed : {0.0, 1e-7, 0.5, 1.0})
      for (const float eta : {0.5F, 1.0F, 3.0F}) {
        VectorCase c;
        c.name = "extreme";
        c.sigma_s = static_cast<float>(sigma * (1 - absorbed)), c.sigma_a = static_cast<float>(sigma * absorbed);
        c.eta = eta;
        c.n_i = {0, 0, 1};
        c.derive();
        for (const double r : {0.0, 1e-30, 1e-12, 1e-3, 1.0, 1e4, 1e9})
          for (const glm::dvec3& x : directions)
            for (const glm::dvec3& n_o : directions)
              for (const glm::dvec3& w_i : directions) {
                if (number++ % fitted(1, 7) != 0) continue;
                c.x_o = x * (r / sigma), c.n_o = n_o, c.w_i = w_i;
                cases.push_back(c);
              }
      }
  return cases;
}

TEST(Bssrdf, DoubleFormAgreesWithTheVectorFile) {
  const std::vector<VectorCase> cases = vector_file();
  ASSERT_GE(cases.size(), 270U);
  // tol holds 16 times the change of S when inputs move by 6e-8; double rounds 5e8 times finer.
  for (const VectorCase& c : cases)
    for (std::size_t m = 0; m < models.size(); ++m)
      EXPECT_LE(std::fabs(exact_bssrdf(c, models[m]) - c.S[m]), 1e-9 * c.tol[m]) << c.name;
}

/// Model and vector width.
class BssrdfOnDevice : public testing::TestWithParam<std::tuple<Model, int>> {
 protected:
  BssrdfOnDevice() {
    compute_ = built(self_test_options(model_, static_cast<std::uint32_t>(width_)), test_selector(), self_test_sources);
  }
  std::vector<float> evaluate(const std::vector<VectorCase>& cases) {
    return device_bssrdf(*compute_, cases, model_, static_cast<std::uint32_t>(width_));
  }
  void expect_judged_well(const std::vector<VectorCase>& cases) {
    const Judgement j = judge(cases, evaluate(cases), model_);
    fmt::print(
        "{} VW={}: {} cases, relative error median {:.2g}, 99.9 % {:.2g}, worst {:.2g}; worst of tol {:.2g}\n"
        "  {}\n",
        model_names[static_cast<std::size_t>(model_)], width_, j.cases, j.median, j.p999, j.worst_relative,
        j.worst_of_tol, vector_json(cases[j.worst]));
    EXPECT_EQ(j.cases, cases.size());
    EXPECT_EQ(j.bad, 0U);
    EXPECT_TRUE(j.passed()) << vector_json(cases[j.worst]);  // the rule that a device passes by
  }

  const Model model_ = std::get<0>(GetParam());
  const int width_ = std::get<1>(GetParam());
  std::shared_ptr<Compute> compute_;
};

TEST_P(BssrdfOnDevice, AgreesWithTheVectorFile) { expect_judged_well(vector_file()); }

TEST_P(BssrdfOnDevice, AgreesWithTheDoubleFormOnRandomCases) {
  expect_judged_well(random_vectors(fitted(20000U, 2000U), 20));
}

TEST_P(BssrdfOnDevice, IsFiniteAndNotNegativeInExtremeCases) {
  const std::vector<VectorCase>& cases = extreme_vectors();
  const std::vector<float> S = evaluate(cases);
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const double truth = exact_bssrdf(cases[i], model_);
    ASSERT_TRUE(std::isfinite(truth) && truth >= 0) << vector_json(cases[i]);
    ASSERT_TRUE(std::isfinite(S[i]) && S[i] >= 0) << vector_json(cases[i]);
    // The device's max() turns NaN into 0.
    if (truth > 1e6 * cases[i].floor()) {
      ASSERT_GT(S[i], 0) << vector_json(cases[i]);
    }
  }
}

TEST_P(BssrdfOnDevice, ScalesExactlyWithPowersOfTwo) {
  const std::vector<VectorCase> cases = vector_file();
  std::vector<VectorCase> scaled = cases;
  const float k = 64;
  for (VectorCase& c : scaled) {
    c.sigma_s *= k, c.sigma_a *= k;
    c.x_i /= k, c.x_o /= k;
    c.derive();
  }
  const std::vector<float> S = evaluate(cases), S_scaled = evaluate(scaled);
  for (std::size_t i = 0; i < cases.size(); ++i)
    if (S[i] > std::numeric_limits<float>::min()) {
      EXPECT_EQ(S_scaled[i], k * k * S[i]) << cases[i].name;
    }
}

INSTANTIATE_TEST_SUITE_P(ModelsAndWidths, BssrdfOnDevice,
                         testing::Combine(testing::ValuesIn(models), testing::Values(1, 8)));

}  // namespace
}  // namespace parian
