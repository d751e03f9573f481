// Scene files and bare meshes: what is read, what is refused, and where things end up in the world.
#include "io/scene_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "scratch.hpp"

namespace parian {
namespace {

using test::Scratch;

// Lengths are compared to this, relative to 100 mm: a few roundings of double precision.
constexpr double tolerance = 1e-9;

void expect_near(const glm::dvec3& a, const glm::dvec3& b) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], tolerance) << "component " << i;
}

/// The box of a mesh: low and high corner.
std::pair<glm::dvec3, glm::dvec3> box(const Mesh& mesh) {
  glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
  for (const glm::dvec3& p : mesh.positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  return {low, high};
}

class SceneTest : public testing::Test {
 protected:
  SceneTest() { scratch_.write("tet.obj", test::tetrahedron); }

  Input load(const std::string& toml, const Overrides& overrides = {}) {
    return load_input(scratch_.write("scene.toml", toml), overrides);
  }

  /// The error that a scene gives, without the file's name: "LINE: what is wrong; what to do".
  std::string refuse(const std::string& toml) {
    const auto path = scratch_.write("scene.toml", toml);
    try {
      (void)load_input(path, {});
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input);
      const std::string message = error.what(), place = path.string() + ":";
      EXPECT_TRUE(message.starts_with(place)) << message;
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      return message.substr(std::min(place.size(), message.size()));
    }
    ADD_FAILURE() << "accepted:\n" << toml;
    return {};
  }

  Scratch scratch_;
};

const std::string object = "[[object]]\nmesh = \"tet.obj\"\n";

TEST_F(SceneTest, BareMeshIsCentredAndFitted) {
  const Input input = load_input(scratch_ / "tet.obj", {});
  const auto [low, high] = box(input.scene.mesh);
  expect_near(low, {-25, -25, -50});
  expect_near(high, {25, 25, 50});
  EXPECT_EQ(input.scene.film, glm::uvec2(512, 512));
  ASSERT_EQ(input.scene.lights.size(), 1u);
  expect_near(input.scene.lights[0].towards, {0.5, 0.6, -0.6});
  EXPECT_NEAR(input.scene.material.ior, 1.5, tolerance);  // marble
  ASSERT_EQ(input.scene.cameras.size(), 1u);
  const Camera& camera = input.scene.cameras[0];
  expect_near(camera.target, {0, 0, 0});
  expect_near(glm::normalize(camera.eye), glm::normalize(glm::dvec3(0.2, 0.15, 1)));
}

TEST_F(SceneTest, SphereFitsBothDirectionsOfTheFilm) {
  for (const double aspect : {0.25, 1.0, 4.0}) {
    for (const double fov : {5.0, 30.0, 120.0}) {
      CameraChoice choice;
      choice.fov = fov;
      const Camera camera = place_camera(choice, {1, 2, 3}, 10, aspect, ErrorKind::input);
      const double vertical = glm::radians(fov / 2), horizontal = std::atan(std::tan(vertical) * aspect);
      const double seen = std::asin(10 / glm::distance(camera.eye, camera.target));
      EXPECT_LE(seen, std::min(vertical, horizontal)) << aspect << ' ' << fov;
      EXPECT_GE(seen, 0.9 * std::min(vertical, horizontal)) << "the object should fill the film";
    }
  }
}

TEST_F(SceneTest, ReadsEveryKey) {
  const Input input = load(
      "size_mm = 50\n[film]\nsize = [64, 32]\n[camera]\neye = [0, 60, 320]\ntarget = [0, 50, 0]\nup = [0, 0, 1]\n"
      "fov = 40\n[[object]]\nmesh = \"tet.obj\"\nmaterial = \"My Wax\"\n[[light]]\ntype = \"directional\"\n"
      "towards = [1, 0, 0]\nirradiance = [1, 2, 3]\n[[light]]\ntowards = [0, 1, 0]\n[material.my-wax]\n"
      "sigma_s = [1.5, 1.2, 0.9]\nsigma_a = [0.003, 0.005, 0.02]\ng = 0.5\nior = 1.44\n[render]\nlayers = 24\n"
      "layer_size = 128\nsamples = 32\nmodel = \"better\"\nerror = 1e-4\nframes = 7\ntime = 2.5\nlight_map_size = 64\n"
      "light_map_shift = false\nestimator = \"disc\"\ndisc_radius = 4\ngather = \"camera\"\nno_pyramids = true\n"
      "seed = 9\nkeep = [\"a\", \"b\"]\nexposure = \"auto\"\ndevice = \"gpu\"\n");
  EXPECT_EQ(input.scene.film, glm::uvec2(64, 32));
  expect_near(input.scene.cameras.at(0).eye, {0, 60, 320});
  expect_near(input.scene.cameras.at(0).up, {0, 0, 1});
  EXPECT_EQ(input.scene.cameras.at(0).fov, 40);
  ASSERT_EQ(input.scene.lights.size(), 2u);
  expect_near(input.scene.lights[0].irradiance, {1, 2, 3});
  expect_near(input.scene.lights[1].irradiance, glm::dvec3(std::numbers::pi));
  expect_near(input.scene.material.sigma_s, {1.5, 1.2, 0.9});
  expect_near(input.scene.material.g, glm::dvec3(0.5));
  EXPECT_EQ(input.scene.material.ior, 1.44);
  const auto [low, high] = box(input.scene.mesh);
  expect_near(low, {0, 0, 0});
  expect_near(high, {25, 25, 50});
  EXPECT_EQ(describe(input.settings),
            "error=0.0001 frames=7 time=2.5 layers=24 layer-size=128 light-map-size=64 light-map-shift=off samples=32 "
            "model=better estimator=disc disc-radius=4 gather=camera no-pyramids=on seed=9 keep=a,b force=off");
  EXPECT_TRUE(input.exposure.automatic);
  EXPECT_EQ(input.device, "gpu");
}

TEST_F(SceneTest, ScalesThenRotatesThenTranslates) {
  // (0,0,2)·unit 3·scale 2 = (0,0,12); x by 90°: (0,-12,0); z by 90°: (12,0,0); then the translation.
  const Input input = load("unit = 3\n" + object + "scale = 2\nrotate = [90, 0, 90]\ntranslate = [1, 10, 100]\n");
  const auto [low, high] = box(input.scene.mesh);
  EXPECT_NEAR(high.x, 13, tolerance);
  EXPECT_NEAR(low.x, 1, tolerance);
  const glm::dvec3 centre = 0.5 * (low + high);
  expect_near(input.scene.cameras.at(0).target, centre);  // fitted to the object where it is
}

TEST_F(SceneTest, ReducedScatteringHasNoMeanCosine) {
  const Input input = load(
      "[[object]]\nmesh = \"tet.obj\"\nmaterial = \"wax\"\n[material.wax]\n"
      "sigma_s_prime = [1, 2, 3]\nsigma_a = [0, 0, 0.1]\n");
  expect_near(input.scene.material.sigma_s, {1, 2, 3});
  expect_near(input.scene.material.g, {0, 0, 0});
}

TEST_F(SceneTest, CommandLineWins) {
  Overrides overrides;
  overrides.material = "SKIN-2";
  overrides.size_mm = 10;
  overrides.film = glm::uvec2(8, 4);
  overrides.fov = 20;
  overrides.lights.emplace_back().towards = {0, 0, 1};
  overrides.camera = CameraChoice{glm::dvec3(0, 0, 9), glm::dvec3(0), {}, {}, "--camera"};
  for (const RenderOption& option : render_options()) {
    if (option.name == "samples") overrides.settings.emplace_back(&option, 64.0);
  }
  const Input input = load("size_mm = 50\n" + object +
                               "[camera]\neye = [1, 2, 3]\n[[light]]\n[[light]]\n"
                               "[render]\nsamples = 32\nseed = 3\n",
                           overrides);
  EXPECT_NEAR(input.scene.material.ior, 1.3, tolerance);
  EXPECT_NEAR(box(input.scene.mesh).second.z, 10, tolerance);
  EXPECT_EQ(input.scene.film, glm::uvec2(8, 4));
  ASSERT_EQ(input.scene.lights.size(), 1u);
  expect_near(input.scene.cameras.at(0).eye, {0, 0, 9});
  EXPECT_EQ(input.scene.cameras.at(0).fov, 20);
  EXPECT_EQ(input.settings.samples, 64u);
  EXPECT_EQ(input.settings.seed, 3u);
}

TEST_F(SceneTest, ReadsManyCameras) {
  Overrides overrides;
  overrides.cameras = scratch_.write("cameras.toml", "[[camera]]\neye = [0, 0, 300]\n[[camera]]\nfov = 10\n");
  EXPECT_EQ(load_input(scratch_ / "tet.obj", overrides).scene.cameras.size(), 2u);
  overrides.cameras = scratch_.write("cameras.toml", "# none\n");
  EXPECT_THROW((void)load_input(scratch_ / "tet.obj", overrides), Error);
}

TEST_F(SceneTest, LooksStraightDown) {
  const Input input = load(object + "[camera]\neye = [0, 300, 0]\ntarget = [0, 0, 0]\n");
  expect_near(input.scene.cameras.at(0).up, {0, 0, -1});
}

struct Refused {
  std::string toml;
  std::string line;  ///< where the mistake is
  std::string says;  ///< part of the message
};

TEST_F(SceneTest, RefusesWithPlaceAndRemedy) {
  const std::vector<Refused> cases{
      {"", "1", "add [[object]]"},
      {"size_mm = \n", "1", "correct the TOML"},
      {object + "[film]\nsise = [1, 1]\n", "4", "did you mean 'size'?"},
      {object + "[flim]\nsize = [1, 1]\n", "3", "did you mean 'film'?"},
      {object + "[render]\nlayer_sise = 3\n", "4", "did you mean 'layer_size'?"},
      {object + "[render]\nsize = 3\n", "4", "[film]"},
      {object + "[render]\nquiet = true\n", "4", "command line"},
      {object + "[render]\nframes = \"12\"\n", "4", "frames: '12' is not"},
      {object + "[render]\nframes = 0\n", "4", "from 1 to"},
      {object + "[render]\nframes = 1.5\n", "4", "whole number"},
      {object + "[render]\nsamples = 3\n", "4", "even"},
      {object + "[render]\nerror = nan\n", "4", "finite"},
      {object + "[render]\nmodel = \"best\"\n", "4", "directional, standard, better"},
      {object + "[render]\nmodel = [\"better\", \"standard\"]\n", "4", "one value"},
      {object + "[render]\nseed = 1\ndisc_radius = 2\n", "5", "choose the estimator disc"},
      {object + "[render]\nexposure = \"bright\"\n", "4", "auto"},
      {object + "[film]\nsize = [1]\n", "4", "1 values"},
      {object + "[film]\nsize = [0, 5]\n", "4", "from 1 to 16384"},
      {object + "[film]\nsize = [5.5, 5]\n", "4", "whole numbers"},
      {object + "[camera]\neye = [0, 1]\n", "4", "2 values"},
      {object + "[camera]\neye = [0, 1, inf]\n", "4", "finite"},
      {object + "[camera]\neye = [0, 1, \"a\"]\n", "4", "three numbers"},
      {object + "[camera]\nfov = 180\n", "4", "above 0 and below 180"},
      {object + "[camera]\ntarget = [0, 0, 0]\n", "4", "no eye"},
      {object + "[camera]\neye = [1, 1, 1]\ntarget = [1, 1, 1]\n", "4", "same point"},
      {object + "[camera]\neye = [0, 0, 9]\ntarget = [0, 0, 0]\nup = [0, 0, 2]\n", "4", "another up"},
      {object + "[[camera]]\n", "3", "--cameras"},
      {object + "[[light]]\ntype = \"point\"\n", "4", "type = \"directional\""},
      {object + "[[light]]\ntowards = [0, 0, 0]\n", "4", "no length"},
      {object + "[[light]]\nirradiance = [1, -1, 0]\n", "4", "from 0 to"},
      {object + "[light]\ntowards = [0, 0, 1]\n", "3", "[[light]]"},
      {object + object, "3", "second [[object]]"},
      {"size_mm = 3\nunit = 2\n" + object, "2", "keep one"},
      {"size_mm = 0\n" + object, "1", "above 0"},
      {"unit = true\n" + object, "1", "truth value"},
      {"[[object]]\n", "1", "add mesh"},
      {"[[object]]\nmesh = \"no.ply\"\n", "2", "relative to the scene"},
      {"[[object]]\nmesh = 3\n", "2", "quotes"},
      {object + "scale = -1\n", "3", "above 0"},
      {object + "scale = 1e9\ntranslate = [0, 0, 1e308]\nmaterial = \"nothing like it\"\n", "5", "nothing like it"},
      {object + "material = \"waxx\"\n[material.wax]\nsigma_s = [1, 1, 1]\nsigma_a = [0, 0, 0]\n", "3", "'wax'"},
      {object + "[material.wax]\nsigma_s = [1, 1, 1]\n", "3", "sigma_a"},
      {object + "[material.wax]\nsigma_a = [1, 1, 1]\n", "3", "sigma_s"},
      {object + "[material.wax]\nsigma_s = [1, 1, 1]\nsigma_s_prime = [1, 1, 1]\n", "5", "keep one"},
      {object + "[material.wax]\nsigma_a = [0, 0, 0]\nsigma_s_prime = [1, 1, 1]\ng = 0\n", "6", "remove g"},
      {object + "[material.wax]\nsigma_a = [0, -1, 0]\nsigma_s = [1, 1, 1]\n", "4", "from 0 to"},
      {object + "[material.wax]\nsigma_a = [0, 0, 0]\nsigma_s = [1, 1, 1]\ng = 1.5\n", "6", "from -1 to 1"},
      {object + "[material]\nwax = 1\n", "4", "[material.NAME]"},
  };
  for (const Refused& refused : cases) {
    const std::string message = refuse(refused.toml);
    EXPECT_TRUE(message.starts_with(refused.line + ": ")) << refused.toml << "-> " << message;
    EXPECT_NE(message.find(refused.says), std::string::npos) << refused.toml << "-> " << message;
  }
}

TEST_F(SceneTest, RefusesWhatIsNoFile) {
  EXPECT_THROW((void)load_input(scratch_ / "none.toml", {}), Error);
  EXPECT_THROW((void)load_input(scratch_ / "none.obj", {}), Error);
  std::filesystem::create_directory(scratch_ / "folder.toml");
  EXPECT_THROW((void)load_input(scratch_ / "folder.toml", {}), Error);
}

TEST(RenderOptionsTest, DefaultsPassTheirOwnRanges) {
  const Settings defaults;
  for (const RenderOption& option : render_options()) {
    Settings settings;
    const std::string text = option.text(defaults);
    const auto number = parse_number(text);
    if (option.values.empty() || option.repeatable) continue;
    EXPECT_EQ(option.set(settings, number ? OptionValue(*number) : OptionValue(text)), "") << option.name;
  }
  EXPECT_EQ(conflict(defaults), "");
}

TEST(RenderOptionsTest, NumbersHaveNothingAroundThem) {
  EXPECT_EQ(parse_number("-1.5e3"), -1500.0);
  EXPECT_EQ(parse_number("+.5"), 0.5);
  for (const char* bad : {"", " 1", "1 ", "1,5", "0x10", "nan", "inf", "1e999", "+-1", "--1", "+"}) {
    EXPECT_FALSE(parse_number(bad)) << bad;
  }
}

}  // namespace
}  // namespace parian
