// The check of a device: it passes here, and when something is broken on purpose it fails and names what.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "core/words.hpp"
#include "plan/plan.hpp"
#include "render/self_test.hpp"
#include "scratch.hpp"
#include "test_scene.hpp"
#include "truth/check.hpp"
#include "truth/extreme_cases.hpp"
#include "truth/stiff_scenes.hpp"

namespace parian {
namespace {

using namespace test;

/// The kernels' text with `from` replaced by `to`, wherever it is.
std::string broken_program(const std::string& from, const std::string& to, std::string text = self_test_sources) {
  std::size_t count = 0;
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()), ++count)
    text.replace(at, from.size(), to);
  EXPECT_GT(count, 0U) << "the kernels no longer have '" << from << "'";
  return text;
}

std::string failures(const CheckReport& report) {
  std::string names;
  for (const CheckResult& r : report.results)
    if (!r.passed) names += fmt::format("{}: {} ({})\n", r.section, r.name, r.found);
  return names;
}

// --- Self-test ---

TEST(SelfTest, PassesHereAtEveryWidth) {
  for (const std::uint32_t lanes : {1U, 4U, 8U}) {
    const std::shared_ptr<Compute> device =
        built(self_test_options(Model::directional, lanes), test_selector(), self_test_sources);
    for (const std::size_t group : {64U, 8U, 1U}) {
      device->limit_groups(group);
      EXPECT_LE(device->group_size("self_test"), group);  // less where the kernel takes no more
      for (const SelfTestAnswer& answer : self_test(*device, Model::directional, lanes)) {
        EXPECT_TRUE(answer.passed) << lanes << " lanes, groups of " << group << ": " << answer.name << ": "
                                   << answer.found;
        if (answer.name == "raster tile") {
          EXPECT_NE(answer.found.find(", 225 are covered"), std::string::npos) << answer.found;  // 15 x 15 of 16 x 16
        }
      }
    }
  }
}

TEST(SelfTest, NamesWhatIsBroken) {
  const struct {
    const char *from, *to, *name;
  } breaks[] = {{"float nearness(RasterTriangle t, int px, int py) {",
                 "float nearness(RasterTriangle t, int px, int py) {\n  if (px > 3000) px += 256;", "raster tile"},
                {"SHARED real real_sqrt(real x) { return sqrt(x); }",
                 "SHARED real real_sqrt(real x) { return sqrt(x) * 1.000001f; }", "sqrt"},
                {"  return rest + power;\n", "  return (rest + power) * 1.000001f;\n", "exp"},
                {"sums[member] += sums[member + half_of];", "sums[member] += sums[member];", "barrier reduction"},
                {"atomic_min(minimum,", "atomic_max(minimum,", "atomic minimum"},
                {"(char*)&value.last - (char*)&value", "(char*)&value.last - (char*)&value + 4", "struct layout"},
                {"const real B_v = F *", "const real B_v = 1.001f * F *", "dipole sum"},
                {"return real_max(S, real_splat(LIT(0.0)));", "return S * (S - S) / (S - S);", "dipole sum"}};  // NaN
  for (const auto& b : breaks) {
    const std::string broken = broken_program(b.from, b.to);
    const std::shared_ptr<Compute> device = built(self_test_options(Model::directional, 1), test_selector(), broken);
    Settings settings;
    try {
      (void)require_sound(*device, settings, 1, broken);
      ADD_FAILURE() << b.name << " is broken, and the device not refused";
    } catch (const Error& error) {
      const std::string text = in_command_words(error.what());
      EXPECT_EQ(error.kind(), ErrorKind::device);
      EXPECT_NE(text.find(fmt::format("'{}'", b.name)), std::string::npos) << text;
      EXPECT_NE(text.find(device->info().name), std::string::npos) << text;
      EXPECT_NE(text.find("--force"), std::string::npos) << text;
    }
    settings.force = true;
    const std::vector<std::string> warnings = require_sound(*device, settings, 1, broken);
    ASSERT_FALSE(warnings.empty());
    EXPECT_NE(warnings.front().find(b.name), std::string::npos) << warnings.front();
  }
}

// --- The rule of vector files ---

/// One pair whose S and tol are as given.
VectorCase pair_with(double S, double tol) {
  VectorCase c = random_vectors(1, 0)[0];
  c.S = {S, S, S}, c.tol = {tol, tol, tol};
  return c;
}

TEST(VectorRule, EveryCaseWithinItsTolerance) {
  const double tol = 0x1p-20;
  const std::vector<VectorCase> cases(2000, pair_with(1.0, tol));
  std::vector<float> S(cases.size(), 1.0F);
  EXPECT_TRUE(judge(cases, S, Model::directional).passed());
  S[7] = static_cast<float>(1.0 + tol);  // exactly
  EXPECT_TRUE(judge(cases, S, Model::directional).passed());
  EXPECT_EQ(judge(cases, S, Model::directional).worst, 7U);
  S[7] = std::nextafter(S[7], 2.0F);
  const Judgement j = judge(cases, S, Model::directional);
  EXPECT_FALSE(j.passed());
  EXPECT_EQ(j.outside, 1U);
  EXPECT_EQ(j.worst, 7U);
}

TEST(VectorRule, MedianAndPercentile) {
  const std::vector<VectorCase> cases(2000, pair_with(1.0, 1.0));
  const auto passed = [&](std::size_t off, double error) {
    std::vector<float> S(cases.size(), 1.0F);
    std::fill_n(S.begin(), off, static_cast<float>(1 + error));
    return judge(cases, S, Model::better).passed();
  };
  EXPECT_TRUE(passed(2000, 0.9e-6));
  EXPECT_FALSE(passed(2000, 1.2e-6)) << "median above 1e-6";
  EXPECT_TRUE(passed(900, 4e-5)) << "the median is 0";
  EXPECT_FALSE(passed(1100, 4e-5)) << "so is not";
  EXPECT_TRUE(passed(1, 1e-3)) << "one of 2000 may be far off";
  EXPECT_FALSE(passed(3, 1e-3)) << "99.9th percentile above 5e-5";
}

TEST(VectorRule, NonsenseFails) {
  const std::vector<VectorCase> cases(1, pair_with(1.0, 1e9));
  for (const float bad : {NAN, INFINITY, -INFINITY, -1e-30F}) {
    const Judgement j = judge(cases, {bad}, Model::standard);
    EXPECT_FALSE(j.passed()) << bad;
    EXPECT_EQ(j.bad, 1U) << bad;
    EXPECT_EQ(j.worst_of_tol, INFINITY) << bad;
  }
  EXPECT_FALSE(judge({}, {}, Model::standard).passed()) << "nothing judged";
  EXPECT_FALSE((Finding{NAN, 1, ""}).passed());
}

// kappa here moves the same inputs as the vector file's did; the file's was found with other directions.
TEST(VectorRule, ToleranceIsTheVectorFiles) {
  double low = INFINITY, high = 0;
  for (const VectorCase& c : read_vectors(PARIAN_TEST_DATA "/vectors.json"))
    for (std::size_t m = 0; m < models.size(); ++m) {
      const double ratio = tolerance(c, models[m]) / c.tol[m];
      low = std::min(low, ratio), high = std::max(high, ratio);
    }
  fmt::print("tolerances are {:.3f} to {:.3f} of the file's\n", low, high);
  EXPECT_GT(low, 0.8);
  EXPECT_LT(high, 1.1);
}

TEST(VectorFile, KeepsEveryBit) {
  const Scratch scratch;
  std::string text;
  const std::vector<VectorCase> cases = random_vectors(50, 3);
  for (const VectorCase& c : cases) text += (text.empty() ? "" : ",\n") + vector_json(c);
  scratch.write("v.json", "{\"cases\": [" + text + "]}");
  const std::vector<VectorCase> read = read_vectors(scratch / "v.json");
  ASSERT_EQ(read.size(), cases.size());
  for (std::size_t i = 0; i < cases.size(); ++i) EXPECT_EQ(vector_json(read[i]), vector_json(cases[i]));
}

TEST(VectorFile, IsReadWithCare) {
  const Scratch scratch;
  const auto expect = [&](const std::string& text, const std::string& says) {
    scratch.write("v.json", text);
    try {
      (void)read_vectors(scratch / "v.json");
      ADD_FAILURE() << "read: " << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input);
      EXPECT_NE(std::string(error.what()).find(says), std::string::npos) << error.what();
    }
  };
  expect("nonsense", "isn't JSON");
  expect("{}", "'cases'");
  expect(R"({"cases": []})", "'cases'");
  expect(R"({"cases": [{"name": "one"}]})", "one: 'sigma_s' is missing");
  nlohmann::json good = nlohmann::json::parse(vector_json(random_vectors(1, 0)[0]));
  const auto changed = [&](const char* key, const nlohmann::json& value) {
    nlohmann::json j = good;
    j[key] = value;
    return nlohmann::json{{"cases", nlohmann::json::array({j})}}.dump();
  };
  expect(changed("sigma_a", "nan"), "'sigma_a' is not a finite number");
  expect(changed("sigma_a", -1), "sigma_a is -1");
  expect(changed("w_i", {1, 2}), "'w_i' is not an array of three");
  expect(changed("S", {{"better", "much"}}), "'S' has no number");
  EXPECT_THROW((void)read_vectors(scratch / "none.json"), Error);
}

// --- The check ---

TEST(Check, PassesHere) {
  CheckSettings settings;
  settings.device = test_selector();
  if (!deep()) settings.random_cases /= 10;
  const CheckReport report = check_device(settings);
  EXPECT_TRUE(report.passed()) << failures(report);
  EXPECT_GE(report.results.size(), 80U);
  ASSERT_EQ(report.worst.size(), models.size());
  for (const CheckResult& r : report.results)
    if (r.section == "random") fmt::print("{}: {}\n", r.name, r.found);
}

TEST(Check, SameSeedSameCases) {
  const auto text = [](std::uint32_t seed) { return vector_json(random_vectors(100, seed)[99]); };
  EXPECT_EQ(text(4), text(4));
  EXPECT_NE(text(4), text(5));
}

TEST(Check, ABrokenKernelFailsAndIsNamed) {
  CheckSettings settings;
  settings.device = test_selector();
  settings.random_cases = 20000;
  settings.scenes = false;
  // Wrong by up to 4e-4, and only where little is absorbed and points are far apart.
  settings.program =
      broken_program("SHARED real attenuation(real t) { return real_exp(-real_min(t, real_splat(LIT(87.0)))); }",
                     "SHARED real attenuation(real t) { return real_exp(-real_min(t, real_splat(LIT(87.0)))) * (1.0f "
                     "+ 2e-4f * t); }");
  const CheckReport report = check_device(settings);
  EXPECT_FALSE(report.passed());
  for (const CheckResult& r : report.results) {
    if (r.section != "random") continue;
    EXPECT_FALSE(r.passed) << r.name;
    EXPECT_NE(r.found.find("outside tol"), std::string::npos) << r.found;
    EXPECT_NE(r.found.find("random "), std::string::npos) << r.found;
  }
}

TEST(ExtremeCases, HaveNamesOfTheirOwn) {
  std::set<std::string> names;
  for (const ExtremeCase& c : extreme_cases()) EXPECT_TRUE(names.insert(c.name).second) << c.name;
}

// The integral of the standard dipole over a plane has a closed form: alpha'/2 (1 + exp(-(z_v - 1) q)) exp(-q).
TEST(PlaneRadiance, IsTheClosedFormOfTheStandardDipole) {
  for (const double absorbed : {0.5, 0.1, 0.01}) {
    const ChannelConstants c = channel_constants(1 - absorbed, absorbed, 0, 1.4);
    const double z_v = exact_medium(c, Model::standard, 1).z_v, q = c.sigma_tr;
    const double R_d = c.alpha_prime / 2 * (1 + std::exp(-(z_v - 1) * q)) * std::exp(-q);
    const double T12 = kernels::fresnel_transmittance(0.6, exact_boundary(1.4));
    const double right = T12 * 0.6 * R_d / std::numbers::pi;
    EXPECT_NEAR(plane_radiance(c, Model::standard, 0.6), right, 1e-9 * right) << absorbed;  // as dipole_albedo promises
  }
}

// --- The command ---

class CheckCommand : public testing::Test {
 protected:
  int run(const std::string& arguments, const std::string& before = "") {
    const std::string command = "cd '" + scratch_.folder().string() + "' && " + before + " '" PARIAN_BINARY "' " +
                                arguments + " >out.txt 2>err.txt </dev/null";
    const int status = std::system(command.c_str());
    out_ = read_bytes(scratch_ / "out.txt");
    err_ = read_bytes(scratch_ / "err.txt");
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  Scratch scratch_;
  std::string out_, err_;
};

const std::string shipped_vectors = "'" PARIAN_TEST_DATA "/vectors.json'";

TEST_F(CheckCommand, RunsAVectorFileAndItsOwnWorstCases) {
  EXPECT_EQ(run("check --json --vectors " + shipped_vectors), 0) << err_;
  const nlohmann::json report = nlohmann::json::parse(out_);
  EXPECT_TRUE(report["passed"]);
  EXPECT_EQ(report["checks"].size(), 3U);
  for (const char* key : {"section", "name", "outcome", "found", "error", "allowed", "passed", "seconds"})
    EXPECT_TRUE(report["checks"][0].contains(key)) << key;
  scratch_.write("worst.json", out_);
  const int code = run("check --vectors worst.json");
  EXPECT_TRUE(code == 0 || code == 1) << err_;  // a few worst cases may well exceed the percentiles, never tol
  EXPECT_EQ(out_.find("outside tol"), std::string::npos) << out_;
}

TEST_F(CheckCommand, FailsForAWrongVectorAndNamesIt) {
  nlohmann::json file = nlohmann::json::parse(read_bytes(PARIAN_TEST_DATA "/vectors.json"));
  auto& c = file["cases"][5];
  c["S"]["standard"] = c["S"]["standard"].get<double>() + 1.5 * c["tol"]["standard"].get<double>();
  scratch_.write("wrong.json", file.dump());
  EXPECT_EQ(run("check --vectors wrong.json"), 1);
  EXPECT_NE(err_.find("parian: check failed: vectors: standard"), std::string::npos) << err_;
  EXPECT_EQ(err_.find("directional"), std::string::npos) << err_;
  EXPECT_NE(out_.find(c["name"].get<std::string>()), std::string::npos) << out_;
}

TEST_F(CheckCommand, RefusesWhatItDoesNotUnderstand) {
  scratch_.write("v.json", "{}");
  EXPECT_EQ(run("check --vectors v.json"), 3);
  EXPECT_TRUE(err_.starts_with("parian: v.json: ")) << err_;
  EXPECT_EQ(run("check --seed 1.5"), 2);
  EXPECT_EQ(run("check --device 'no such device'"), 4);
}

// PoCL adds what this variable holds to every build: a driver that compiles another model than it is told to.
TEST_F(CheckCommand, ADeviceThatComputesWronglyIsRefused) {
  const std::string broken = "POCL_EXTRA_BUILD_FLAGS=-DMODEL=1";
  scratch_.write("tet.obj", tetrahedron);
  const std::string render = "render tet.obj --size 8x8 --gather camera --light-map-size 16 ";
  const int code = run(render + "-o a.exr --frames 1", broken);
  if (code == 0) GTEST_SKIP() << "not PoCL";
  EXPECT_EQ(code, 4);
  EXPECT_NE(err_.find("'dipole sum'"), std::string::npos) << err_;
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "a.exr"));
  EXPECT_EQ(run("render tet.obj -o a.exr --size 8x8 --frames 1 --layer-size 16 --light-map-size 16 --force", broken),
            0);
  EXPECT_NE(err_.find("fails the self-test"), std::string::npos) << err_;
  EXPECT_EQ(run("check --vectors " + shipped_vectors, broken), 1);
  EXPECT_NE(err_.find("vectors: directional"), std::string::npos) << err_;
}

}  // namespace
}  // namespace parian
