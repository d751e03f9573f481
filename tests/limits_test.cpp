// Limits in words and at their ends, and the same ones at every border.
#include "scene/limits.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "io/render_options.hpp"
#include "io/scene_file.hpp"
#include "scratch.hpp"

namespace parian {
namespace {

TEST(Limits, IntervalsKnowTheirEnds) {
  const Interval closed{0, 5}, open{0, 5, true, true}, half{0, 5, true}, endless{0, no_limit};
  EXPECT_TRUE(closed.holds(0) && closed.holds(5));
  EXPECT_FALSE(open.holds(0) || open.holds(5));
  EXPECT_TRUE(half.holds(5) && half.holds(1e-300));
  EXPECT_FALSE(half.holds(0) || half.holds(5.1));
  EXPECT_TRUE(endless.holds(1e308));
  for (const Interval& limit : {closed, open, half, endless}) {
    EXPECT_FALSE(limit.holds(NAN) || limit.holds(INFINITY) || limit.holds(-1));
  }
  EXPECT_EQ(closed.text(), "a number from 0 to 5");
  EXPECT_EQ(open.text(), "a number above 0 and below 5");
  EXPECT_EQ(half.text(), "a number above 0, at most 5");
  EXPECT_EQ(endless.text(), "a number from 0 on");
}

TEST(Limits, WholeSettingsTakeWholeNumbers) {
  const WholeSetting even{"even", &Settings::samples, 2, 8, 2};
  for (const double good : {2, 4, 8}) EXPECT_TRUE(even.holds(good)) << good;
  for (const double bad : {0.0, 3.0, 4.5, 10.0, double(NAN), double(INFINITY), -2.0})
    EXPECT_FALSE(even.holds(bad)) << bad;
  EXPECT_EQ(even.text(), "an even number from 2 to 8");
  EXPECT_EQ((WholeSetting{"any", &Settings::seed, 0, 9}.text()), "a whole number from 0 to 9");
}

TEST(Limits, DefaultsAreInside) {
  EXPECT_FALSE(problem_of(Settings()));
  EXPECT_FALSE(problem_of(DirectionalLight()));
  Camera camera;
  EXPECT_EQ(problem_of(camera)->text(), "eye and target are the same point; move one");
  camera.eye.z = 1;
  EXPECT_FALSE(problem_of(camera));
}

TEST(Limits, OptionsHaveThoseOfSettings) {
  for (const WholeSetting& s : whole_settings) {
    std::string name = s.name;
    std::replace(name.begin(), name.end(), '_', '-');
    const auto& options = render_options();
    const auto option = std::find_if(options.begin(), options.end(), [&](const auto& o) { return o.name == name; });
    ASSERT_NE(option, options.end()) << name;
    Settings settings;
    EXPECT_EQ(option->set(settings, double(s.least)), "") << name;
    EXPECT_EQ(settings.*s.member, s.least);
    EXPECT_EQ(option->set(settings, double(s.most / s.step * s.step)), "") << name;
    EXPECT_FALSE(problem_of(settings)) << name;
    EXPECT_NE(option->set(settings, double(s.most) + s.step).find(s.text()), std::string::npos) << name;
    EXPECT_NE(option->set(settings, double(s.least) - 1), "") << name;
  }
}

/// A scene of one triangle with `more` after the object, and its [[light]] and [material.own].
Input loaded(const test::Scratch& scratch, const std::string& more) {
  scratch.write("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  return load_input(scratch.write("s.toml", "[[object]]\nmesh = \"t.obj\"\nmaterial = \"own\"\n" + more), {});
}

// What the C API took all along and files refused: irradiance above 1e9, coefficients above 1e6, fields of view and
// settings at both ends.
TEST(Limits, FilesTakeWhatTheApiTakes) {
  const test::Scratch scratch;
  const Input input = loaded(scratch,
                             "[camera]\neye = [0, 0, 9]\nfov = 179.9\n[[light]]\ntowards = [0, 0, 1e100]\n"
                             "irradiance = [1e30, 0, 1e10]\n[material.own]\nsigma_s = [1e15, 1e7, 0]\n"
                             "sigma_a = [1e15, 1, 1e15]\ng = [1, -1, 0]\nior = 100\n"
                             "[render]\nerror = 1e7\nlayers = 1024\nlayer_size = 16384\nlight_map_size = 1\n"
                             "samples = 1048576\nexposure = -100\n");
  EXPECT_EQ(input.scene.lights.at(0).irradiance, glm::dvec3(1e30, 0, 1e10));
  EXPECT_EQ(input.scene.material.sigma_s, glm::dvec3(1e15, 1e7, 0));
  EXPECT_EQ(input.scene.cameras.at(0).fov, 179.9);
  EXPECT_EQ(input.settings.layers, 1024U);
  EXPECT_EQ(input.exposure.stops, -100.0);
  EXPECT_NO_THROW(check_lights(input.scene.lights));
  EXPECT_NO_THROW(check_cameras(input.scene.cameras, input.scene.film));
  EXPECT_FALSE(problem_of(input.scene.material));
  EXPECT_FALSE(problem_of(input.settings));
}

TEST(Limits, FilesRefuseWhatTheApiRefuses) {
  const test::Scratch scratch;
  const std::string medium = "[material.own]\nsigma_s = [1, 1, 1]\nsigma_a = [1, 1, 1]\n";
  const std::string dark = "[material.own]\nsigma_a = [0, 0, 0]\n";
  const struct {
    std::string toml, line, says;
  } cases[] = {
      {medium + "[[light]]\nirradiance = [1, 1, 1e31]\n", "8", "irradiance is 1e+31 in channel B"},
      {medium + "[[light]]\ntowards = [1e200, 0, 0]\n", "8", "towards has a length that is no number"},
      {medium + "ior = 100.5\n", "7", "ior = 100.5 is out of range; give a number above 0, at most 100"},
      {dark + "sigma_s_prime = [1, 1e16, 1]\n", "6", "sigma_s_prime is 1e+16 in channel G"},
      {dark + "sigma_s = [1, 1, 1]\ng = 1\n", "4", "give it scattering or absorption"},
      {medium + "[render]\nlayers = 1025\n", "8", "a whole number from 1 to 1024"},
  };
  for (const auto& c : cases) {
    try {
      (void)loaded(scratch, c.toml);
      ADD_FAILURE() << c.toml;
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find("s.toml:" + c.line + ": "), std::string::npos) << message;
      EXPECT_NE(message.find(c.says), std::string::npos) << message;
    }
  }
}

}  // namespace
}  // namespace parian
