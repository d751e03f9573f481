// Constants of media against independent quadrature and published figures; the table of materials and its look-up.
#include "scene/medium.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "core/error.hpp"
#include "scene/limits.hpp"

namespace parian {
namespace {

/// Tanh-sinh quadrature over [0, 1] in long double; f gets the distance from 0 so that a root there is exact.
long double integral(const std::function<long double(long double)>& f) {
  const long double h = 1.0L / 64, half_pi = std::numbers::pi_v<long double> / 2;
  long double sum = 0;
  for (int k = -320; k <= 320; ++k) {
    const long double t = h * k;
    const long double e = std::exp(2 * half_pi * std::sinh(t));
    const long double x = e / (1 + e);
    sum += f(x) * half_pi * std::cosh(t) * 2 * x / (1 + e);
  }
  return h * sum;
}

/// int_0^1 R mu^power dmu by the textbook form of Fresnel's equations, from the inside, split at the critical angle.
long double moment(long double eta, int power) {
  const long double critical = eta > 1 ? std::sqrt((eta - 1) * (eta + 1)) / eta : 0;
  const auto R = [&](long double mu) {
    const long double c_t = std::sqrt(std::max(1 - eta * eta * (1 - mu * mu), 0.0L));
    const long double s = (eta * mu - c_t) / (eta * mu + c_t), p = (mu - eta * c_t) / (mu + eta * c_t);
    return (s * s + p * p) / 2 * std::pow(mu, static_cast<long double>(power));
  };
  return std::pow(critical, static_cast<long double>(power + 1)) / static_cast<long double>(power + 1) +
         (1 - critical) * integral([&](long double t) { return R(critical + (1 - critical) * t); });
}

TEST(FresnelMoments, AgreeWithTanhSinhQuadrature) {
  for (const double eta : {0.3, 0.5, 1 / 1.5, 0.9, 0.999, 1.0001, 1.01, 1.1, 1.3, 1.33, 1.5, 2.0, 3.0, 10.0}) {
    const FresnelMoments m = fresnel_moments(eta);
    // 1e-12: the textbook R itself loses digits where 1 - eta^2 (1 - mu^2) cancels.
    EXPECT_NEAR(m.C_phi, static_cast<double>((1 - 2 * moment(eta, 1)) / 4), 1e-12) << "eta " << eta;
    EXPECT_NEAR(m.C_E, static_cast<double>((1 - 3 * moment(eta, 2)) / 2), 1e-12) << "eta " << eta;
  }
}

TEST(FresnelMoments, AreExactWhenMatched) {
  EXPECT_NEAR(fresnel_moments(1).C_phi, 0.25, 1e-15);
  EXPECT_NEAR(fresnel_moments(1).C_E, 0.5, 1e-15);
  EXPECT_NEAR(channel_constants(1, 0.1, 0, 1).A, 1, 1e-14);
}

TEST(FresnelMoments, AgreeWithPublishedFits) {
  struct Row {
    double eta, two_C_1, error_1, three_C_2, error_2;  // fits of d'Eon and Irving 2011, and their known errors
  };
  for (const Row& r : {Row{1 / 1.3, 0.061116, -2e-5, 0.035378, 3e-5}, Row{1.1, 0.192728, -0.0016, 0.083291, -0.0046},
                       Row{1.3, 0.445295, 0.0008, 0.297448, -0.0028}, Row{1.5, 0.596541, 0.0002, 0.462609, -0.0018},
                       Row{2.0, 0.790536, 0.0004, 0.706720, 0.0019}, Row{2.5, 0.876878, 0.0014, 0.827561, 0.0069}}) {
    const FresnelMoments m = fresnel_moments(r.eta);
    EXPECT_NEAR(1 - 4 * m.C_phi, r.two_C_1 - r.error_1, 6e-5) << r.eta;  // errors are known to four digits
    EXPECT_NEAR(1 - 2 * m.C_E, r.three_C_2 - r.error_2, 6e-5) << r.eta;
  }
}

TEST(ChannelConstants, FollowTheirDefinitions) {
  const ChannelConstants c = channel_constants(10, 0.1, 0.9, 1.3);  // sigma_s' 1, sigma_t' 1.1, sigma_t 10.1
  EXPECT_NEAR(c.sigma_t_prime, 1.1, 1e-14);
  EXPECT_NEAR(c.alpha_prime, 1 / 1.1, 1e-14);
  EXPECT_NEAR(c.sigma_tr, std::sqrt(0.3 / 1.1), 1e-14);
  EXPECT_NEAR(c.d_e, 2.131 / 3 / std::sqrt(1 / 1.1), 1e-14);
  EXPECT_NEAR(c.a_back, std::pow(1.1 / (3 * 10.1), 2), 1e-15);
  EXPECT_NEAR(c.z_v, 2 * c.A * c.d_e, 1e-15);
  EXPECT_EQ(channel_constants(1e9, 1e-9, 0, 1.3).absorbed, 1e-9 / (1e9 + 1e-9));  // no cancellation
}

/// Closed-form diffuse reflectance of Jensen's dipole, alpha'/2 (1 + exp(-4/3 A q)) exp(-q), from device constants.
TEST(ChannelConstants, GiveTheDiffuseReflectanceThatJensenPrints) {
  const struct {
    const char* name;
    double Rd[3];
  } rows[] = {{"Apple", {0.846, 0.841, 0.528}}, {"Marble", {0.830, 0.791, 0.753}}, {"Skin1", {0.436, 0.227, 0.131}}};
  for (const auto& row : rows) {
    const Material m = find_material(row.name);
    for (int c = 0; c < 3; ++c) {
      const ChannelConstants k = channel_constants(m.sigma_s[c], m.sigma_a[c], m.g[c], m.ior);
      const double z_v = exact_medium(k, Model::standard, 1).z_v;
      const double Rd = k.alpha_prime / 2 * (1 + std::exp(-(z_v - 1) * k.sigma_tr)) * std::exp(-k.sigma_tr);
      EXPECT_NEAR(Rd, row.Rd[c], 6e-4) << row.name;  // three printed digits
    }
  }
}

void expect_finite(const kernels::Medium& m, const std::string& what) {
  for (const float x : {m.sigma_t_prime, m.sigma_tr, m.d_e, m.z_v, m.a_back, m.fluence, m.C_E, m.scale})
    EXPECT_TRUE(std::isfinite(x) && x >= 0) << what;
}

TEST(ChannelConstants, AreFiniteAtTheLimits) {
  for (const double sigma_s : {0.0, 1e-9, 1.0, 1e13})
    for (const double sigma_a : {0.0, 1e-9, 1.0, 1e13})
      for (const double g : {-1.0, 0.0, 1 - 1e-9, 1.0})
        for (const double eta : {0.1, 0.5, 0.999999, 1.0, 1.000001, 1.5, 5.0, 20.0})
          for (const Model model : {Model::directional, Model::standard, Model::better}) {
            const kernels::Medium m = device_medium(channel_constants(sigma_s, sigma_a, g, eta), model, 1);
            expect_finite(m, std::to_string(sigma_s) + " " + std::to_string(sigma_a) + " " + std::to_string(g) + " " +
                                 std::to_string(eta));
            if (sigma_s * (1 - g) == 0) {
              EXPECT_EQ(m.scale, 0);
            }
          }
}

TEST(ChannelConstants, ScaleGoesWithTheSquareOfTheUnit) {
  const ChannelConstants c = channel_constants(1, 0.1, 0, 1.3);
  for (const Model model : {Model::directional, Model::standard, Model::better}) {
    const kernels::Medium one = device_medium(c, model, 1), four = device_medium(c, model, 4);
    EXPECT_EQ(four.sigma_t_prime, 4 * one.sigma_t_prime);
    EXPECT_EQ(four.scale, 16 * one.scale);
    EXPECT_EQ(four.z_v, one.z_v);
  }
}

TEST(Materials, AreAllThereAndUsable) {
  ASSERT_EQ(measured_materials().size(), 47U);
  for (const MeasuredMaterial& row : measured_materials()) {
    SCOPED_TRACE(row.material.name);
    EXPECT_NO_THROW(validate(row.material, "table"));
    EXPECT_FALSE(row.dataset.empty());
    EXPECT_EQ(find_material(row.material.name).sigma_a, row.material.sigma_a);
    for (int c = 0; c < 3; ++c)
      expect_finite(device_medium(channel_constants(row.material.sigma_s[c], row.material.sigma_a[c], row.material.g[c],
                                                    row.material.ior),
                                  Model::directional, 1),
                    row.material.name);
  }
  const Material marble = find_material("marble");  // only reduced coefficients known
  EXPECT_EQ(marble.sigma_s, glm::dvec3(2.19, 2.62, 3.00));
  EXPECT_EQ(marble.sigma_a, glm::dvec3(0.0021, 0.0041, 0.0071));
  EXPECT_EQ(marble.g, glm::dvec3(0));
  EXPECT_EQ(marble.ior, 1.5);
  const Material beer = find_material("budweiser beer");
  EXPECT_EQ(beer.sigma_s, glm::dvec3(0.00029, 0.00055, 0.00059));
  EXPECT_EQ(beer.g, glm::dvec3(0.917, 0.956, 0.982));
  EXPECT_EQ(beer.ior, 1.33);
}

TEST(Materials, AreFoundHoweverWritten) {
  for (const char* name : {"Skimmilk", "Skim Milk", "skim-milk", "SKIM_MILK"})
    EXPECT_EQ(find_material(name).name, "Skimmilk") << name;
  for (const char* name : {"head & shoulders shampoo", "Head_&-Shoulders Shampoo"})
    EXPECT_EQ(find_material(name).name, "Head & Shoulders Shampoo") << name;
}

TEST(Materials, SuggestTheNearestName) {
  for (const auto& [wrong, right] : {std::pair{"marbel", "Marble"}, {"aple", "Apple"}, {"kechup", "Ketchup"}}) {
    try {
      (void)find_material(wrong);
      FAIL() << wrong;
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::input);
      EXPECT_NE(std::string(e.what()).find(right), std::string::npos) << e.what();
    }
  }
  EXPECT_THROW((void)find_material(""), Error);
}

TEST(Validate, NamesTheFieldThatIsWrong) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const Material good{.name = "m", .sigma_s = glm::dvec3(1), .sigma_a = glm::dvec3(0.1), .g = {}, .ior = 1.3};
  EXPECT_NO_THROW(validate(good, "here"));
  const std::pair<const char*, std::function<void(Material&)>> bad[] = {
      {"sigma_s", [=](Material& m) { m.sigma_s[1] = nan; }},
      {"sigma_s", [=](Material& m) { m.sigma_s[0] = -1; }},
      {"sigma_s", [=](Material& m) { m.sigma_s[2] = inf; }},
      {"sigma_a", [=](Material& m) { m.sigma_a[1] = nan; }},
      {"sigma_a", [=](Material& m) { m.sigma_a[0] = -1e-9; }},
      {"g is", [=](Material& m) { m.g[0] = nan; }},
      {"g is", [=](Material& m) { m.g[2] = 1.0001; }},
      {"g is", [=](Material& m) { m.g[2] = -2; }},
      {"ior", [=](Material& m) { m.ior = 0; }},
      {"ior", [=](Material& m) { m.ior = -1.3; }},
      {"ior", [=](Material& m) { m.ior = nan; }},
      {"ior", [=](Material& m) { m.ior = inf; }},
      {"sigma_s (1 - g) + sigma_a", [=](Material& m) { m.sigma_s = m.sigma_a = glm::dvec3(0); }},
      {"sigma_s (1 - g) + sigma_a", [=](Material& m) { m.sigma_a[1] = 0, m.g[1] = 1; }},
  };
  for (const auto& [field, spoil] : bad) {
    Material m = good;
    spoil(m);
    try {
      validate(m, "here");
      ADD_FAILURE() << field;
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::input);
      EXPECT_EQ(std::string(e.what()).rfind("here: " + std::string(field), 0), 0U) << e.what();
    }
  }
}

std::vector<std::string> doubts(const Material& m) { return doubts_of(m, optics_of(m)); }

TEST(Validate, TellsLikelyMistakes) {
  Material m = find_material("marble");
  EXPECT_TRUE(doubts(m).empty());
  m.ior = 1;
  EXPECT_TRUE(doubts(m).empty());
  m.ior = 1 / 1.5;
  ASSERT_EQ(doubts(m).size(), 1U);
  EXPECT_NE(doubts(m)[0].find("ior 0.666667 is below 1"), std::string::npos) << doubts(m)[0];
  EXPECT_NE(doubts(m)[0].find("give 1.5 then"), std::string::npos) << doubts(m)[0];
  for (const MeasuredMaterial& row : measured_materials())
    for (const std::string& doubt : doubts(row.material)) EXPECT_EQ(doubt.find("ior"), std::string::npos) << doubt;
}

}  // namespace
}  // namespace parian
