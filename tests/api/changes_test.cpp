// What changes between frames cost and keep.
#include <algorithm>
#include <limits>

#include "frames.hpp"

namespace parian::test {
namespace {

TEST(Changes, CamerasAndFilmKeepTheSums) {
  SmallScene scene, moved;
  moved.camera.eye[0] = 90.0;
  moved.camera.fov = 50.0;
  const Handle r = planned(scene);
  frames(r.get(), 2);
  CALL(parian_set_cameras(r.get(), 1, &moved.camera, SmallScene::width, SmallScene::height));
  frames(r.get(), 1);
  EXPECT_EQ(summed(r.get()), 3U);
  EXPECT_EQ(gathered(r.get()), fresh(moved, 3)) << "moved camera";
  // Another film and two cameras, and back.
  const parian_camera both[] = {scene.camera, moved.camera};
  CALL(parian_set_cameras(r.get(), 2, both, 40, 31));
  const cl::Buffer large = opencl().buffer(40 * 31 * 16);
  auto image = sized<parian_image>();
  image.buffer = large();
  CALL(parian_gather(r.get(), nullptr, 1, &image, 0, nullptr, nullptr));
  CALL(parian_set_cameras(r.get(), 1, &scene.camera, SmallScene::width, SmallScene::height));
  EXPECT_EQ(summed(r.get()), 3U);
  EXPECT_EQ(gathered(r.get()), fresh(scene, 3)) << "the first camera again";
}

TEST(Changes, ExposureScales) {
  const Handle r = planned(SmallScene());
  frames(r.get(), 1);
  const Rgba before = gathered(r.get());
  const Pixels pixels;
  parian_image image = pixels.image();
  image.exposure = 3.0F;
  cl_event done = nullptr;
  CALL(parian_gather(r.get(), nullptr, 0, &image, 0, nullptr, &done));
  EXPECT_EQ(pixels.read(done), scaled(before, {8, 8, 8}));
  EXPECT_EQ(summed(r.get()), 1U);
}

TEST(Changes, ColourOfLightRescales) {
  SmallScene scene;
  scene.lights.push_back(SmallScene::light({1, 0.2, 0.4}, 1.5));
  const Handle r = planned(scene);
  frames(r.get(), 2);
  const Rgba before = gathered(r.get());
  const std::array<float, 3> factor{4.0F, 0.5F, 2.0F};
  std::vector<parian_light> lights = scene.lights;
  for (parian_light& l : lights)
    for (int c = 0; c < 3; ++c) l.irradiance[c] *= factor[c];
  CALL(parian_set_lights(r.get(), 2, lights.data()));
  EXPECT_EQ(gathered(r.get()), scaled(before, factor));
  frames(r.get(), 1);
  EXPECT_EQ(summed(r.get()), 3U);
  const Rgba three = gathered(r.get());
  CALL(parian_set_lights(r.get(), 2, scene.lights.data()));
  EXPECT_EQ(scaled(gathered(r.get()), factor), three);
  EXPECT_EQ(gathered(r.get()), fresh(scene, 3));
  // Black in one channel, and back.
  for (parian_light& l : lights) l.irradiance[1] = 0.0;
  CALL(parian_set_lights(r.get(), 2, lights.data()));
  EXPECT_EQ(gathered(r.get()), scaled(three, {1, 0, 1}));
  CALL(parian_set_lights(r.get(), 2, scene.lights.data()));
  EXPECT_EQ(summed(r.get()), 3U);
  EXPECT_EQ(gathered(r.get()), fresh(scene, 3));
  // What is read, and how good it is.
  double relative = 0.0, relative_scaled = 0.0;
  Rgba read(Pixels::count * 4), read_scaled(Pixels::count * 4);
  CALL(parian_read(r.get(), nullptr, 0, read.data(), &relative));
  for (std::size_t l = 0; l < 2; ++l)
    for (int c = 0; c < 3; ++c) lights[l].irradiance[c] = 8.0 * scene.lights[l].irradiance[c];
  CALL(parian_set_lights(r.get(), 2, lights.data()));
  CALL(parian_read(r.get(), nullptr, 0, read_scaled.data(), &relative_scaled));
  EXPECT_EQ(read_scaled, scaled(read, {8, 8, 8}));
  EXPECT_EQ(relative_scaled, relative);
}

/// Lights from some sides, of so much irradiance.
std::vector<parian_light> lights_of(const std::vector<std::array<double, 3>>& irradiance) {
  std::vector<parian_light> lights;
  for (std::size_t l = 0; l < irradiance.size(); ++l) {
    const double turn = 2.0 * static_cast<double>(l);
    lights.push_back(SmallScene::light({std::cos(turn), 0.4, std::sin(turn)}, 0.0));
    std::copy(irradiance[l].begin(), irradiance[l].end(), lights.back().irradiance);
  }
  return lights;
}

Rgba read(parian_renderer* r, double* relmse = nullptr) {
  Rgba rgba(Pixels::count * 4);
  EXPECT_EQ(parian_read(r, nullptr, 0, rgba.data(), relmse), PARIAN_SUCCESS) << parian_message();
  return rgba;
}

// All colours have the same flux, so that a new plan divides samples between lights alike, and every bit must agree:
// of layers and their pyramids, of pixels that no layer sees, of estimates.
TEST(Changes, ColoursOfSingleLightsKeepTheSums) {
  SmallScene scene, other;
  scene.material.sigma_s[0] = scene.material.sigma_s[1];  // channels that share their evaluations, not their colours
  scene.material.sigma_a[0] = scene.material.sigma_a[1];
  other.material = scene.material;
  scene.lights = lights_of({{1, 2, 3}, {3, 0, 1}, {0.25, 0.25, 0.5}});
  other.lights = lights_of({{5, 0, 1}, {0, 1, 3}, {0.5, 0.25, 0.25}});
  const Handle r = planned(scene);
  frames(r.get(), 3);
  const Rgba before = gathered(r.get());
  double relative = 0.0, relative_fresh = 0.0;
  CALL(parian_set_lights(r.get(), 3, other.lights.data()));
  EXPECT_EQ(summed(r.get()), 3U);
  EXPECT_EQ(gathered(r.get()), fresh(other, 3)) << "at once";
  CALL(parian_set_lights(r.get(), 3, scene.lights.data()));
  EXPECT_EQ(gathered(r.get()), before);
  frames(r.get(), 1);
  EXPECT_EQ(gathered(r.get()), fresh(scene, 4));
  // From nearly nothing to a great deal.
  for (const double e : {1e-28, 1e28}) {
    const std::vector<parian_light> lights = lights_of({{e, e, e}, {e, 0, e}, {0.25 * e, 0.5 * e, 0.25 * e}});
    CALL(parian_set_lights(r.get(), 3, lights.data()));
    EXPECT_EQ(summed(r.get()), 4U);
    expect_picture(gathered(r.get()));
  }
  CALL(parian_set_lights(r.get(), 3, other.lights.data()));
  frames(r.get(), 1);
  const Handle anew = planned(other);
  frames(anew.get(), 5);
  EXPECT_EQ(read(r.get(), &relative), read(anew.get(), &relative_fresh));
  EXPECT_EQ(relative, relative_fresh);
  auto statistics = sized<parian_statistics>();
  CALL(parian_get_statistics(r.get(), &statistics));
  EXPECT_EQ(statistics.frames, 5U);
  EXPECT_GT(statistics.fallback_pixels, 0U) << "no pixel was computed directly";
  EXPECT_GE(statistics.bytes_planned, statistics.bytes_peak);
  EXPECT_EQ(statistics.estimated_relmse, relative);
  CALL(parian_set_lights(r.get(), 3, scene.lights.data()));
  CALL(parian_get_statistics(r.get(), &statistics));
  EXPECT_LT(statistics.estimated_relmse, 0.0) << "known no more";
}

// Each light's part of the picture on its own, which adding up and colours round by a few 2^-24.
TEST(Changes, PicturesAreLinearInColours) {
  SmallScene scene;
  scene.lights = lights_of({{1, 2, 3}, {3, 0, 1}});
  const Handle r = planned(scene);
  frames(r.get(), 3);
  const auto image = [&](const std::vector<std::array<double, 3>>& irradiance) {
    const std::vector<parian_light> lights = lights_of(irradiance);
    EXPECT_EQ(parian_set_lights(r.get(), lights.size(), lights.data()), PARIAN_SUCCESS) << parian_message();
    return gathered(r.get());
  };
  const Rgba first = image({{1, 1, 1}, {0, 0, 0}}), second = image({{0, 0, 0}, {1, 1, 1}}),
             both = image({{0.3, 4.1, 20}, {3.3, 0.07, 0}});
  EXPECT_EQ(summed(r.get()), 3U);
  double worst = 0.0;
  for (std::size_t i = 0; i < both.size(); ++i) {
    if (i % 4 == 3) continue;
    const std::array<double, 3> a{0.3, 4.1, 20}, b{3.3, 0.07, 0};
    const double right = a[i % 4] * double{first[i]} + b[i % 4] * double{second[i]};
    worst = std::max(worst, std::abs(both[i] - right) / std::max(right, 1e-30));
  }
  RecordProperty("worst", std::to_string(worst));
  EXPECT_LE(worst, 16 * 0x1p-24);
}

// Samples go to lights by their flux when a plan is made; after that they stay, and so does what they estimate.
TEST(Changes, OtherFluxesEstimateTheSamePicture) {
  SmallScene scene, other;
  scene.lights = lights_of({{8, 8, 8}, {0.5, 0.5, 0.5}});
  other.lights = lights_of({{0.5, 1, 0.5}, {8, 4, 8}});
  const Handle r = planned(scene);
  frames(r.get(), 100);
  CALL(parian_set_lights(r.get(), 2, other.lights.data()));
  EXPECT_EQ(summed(r.get()), 100U);
  const Handle f = planned(other);
  frames(f.get(), 100);
  const double difference = relmse(gathered(r.get(), nullptr, 8), gathered(f.get(), nullptr, 8));
  RecordProperty("relmse", std::to_string(difference));
  EXPECT_LE(difference, 2e-3);
}

TEST(Changes, OtherColoursOfManyLightsStartAnew) {
  SmallScene scene, other;
  scene.lights = lights_of({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}});
  {
    const Handle eight = planned(scene);
    frames(eight.get(), 1);
    other.lights = scene.lights;
    other.lights[7].irradiance[0] = 0.0;
    CALL(parian_set_lights(eight.get(), 8, other.lights.data()));
    EXPECT_EQ(summed(eight.get()), 1U);
    frames(eight.get(), 1);
    EXPECT_EQ(summed(eight.get()), 2U);
  }
  scene.lights.push_back(SmallScene::light({1, 0.2, 0.4}, 1.5));
  other.lights = scene.lights;
  other.lights[0].irradiance[0] += 0.5;  // the same flux: samples are divided between lights as before
  other.lights[0].irradiance[2] -= 0.5;
  const Handle r = planned(scene);
  frames(r.get(), 3);
  const Rgba before = gathered(r.get());
  CALL(parian_set_lights(r.get(), 9, other.lights.data()));
  EXPECT_EQ(gathered(r.get()), before) << "until the next frame";
  frames(r.get(), 2);
  EXPECT_EQ(summed(r.get()), 2U);
  EXPECT_EQ(gathered(r.get()), fresh(other, 2));
  // All of them times the same colour.
  const std::array<float, 3> factor{4.0F, 0.5F, 2.0F};
  const Rgba two = gathered(r.get());
  std::vector<parian_light> lights = other.lights;
  for (parian_light& l : lights)
    for (int c = 0; c < 3; ++c) l.irradiance[c] *= factor[c];
  CALL(parian_set_lights(r.get(), 9, lights.data()));
  EXPECT_EQ(gathered(r.get()), scaled(two, factor));
  // From nearly nothing to a great deal there are no digits left to rescale.
  for (parian_light& l : other.lights)
    for (double& e : l.irradiance) e = 1e-28;
  CALL(parian_set_lights(r.get(), 9, other.lights.data()));
  frames(r.get(), 2);
  for (parian_light& l : other.lights)
    for (double& e : l.irradiance) e = 1e28;
  CALL(parian_set_lights(r.get(), 9, other.lights.data()));
  frames(r.get(), 1);
  EXPECT_EQ(summed(r.get()), 1U);
  expect_picture(gathered(r.get()));
}

TEST(Changes, NumberOfLightsNeedsAPlan) {
  SmallScene scene;
  const Handle r = planned(scene);
  frames(r.get(), 1);
  scene.lights.push_back(SmallScene::light({1, 0.2, 0.4}, 1.5));
  CALL(parian_set_lights(r.get(), 2, scene.lights.data()));
  EXPECT_EQ(parian_frame(r.get(), nullptr, 0, nullptr, nullptr), PARIAN_NOT_PLANNED);
  CALL(parian_plan(r.get(), nullptr));
  frames(r.get(), 2);
  EXPECT_EQ(gathered(r.get()), fresh(scene, 2));
  const SmallScene lit = scene;
  for (double& e : scene.lights[0].irradiance) e = 0.0;  // goes dark
  CALL(parian_set_lights(r.get(), 2, scene.lights.data()));
  EXPECT_EQ(summed(r.get()), 2U);
  CALL(parian_set_lights(r.get(), 2, lit.lights.data()));
  EXPECT_EQ(gathered(r.get()), fresh(lit, 2));
  CALL(parian_set_lights(r.get(), 2, scene.lights.data()));
  CALL(parian_plan(r.get(), nullptr));
  frames(r.get(), 1);
  CALL(parian_set_lights(r.get(), 2, lit.lights.data()));  // comes on, which was dark when planned
  EXPECT_EQ(parian_frame(r.get(), nullptr, 0, nullptr, nullptr), PARIAN_NOT_PLANNED);
  CALL(parian_set_lights(r.get(), 0, nullptr));
  CALL(parian_plan(r.get(), nullptr));
  frames(r.get(), 1);
  const Rgba dark = gathered(r.get());
  for (std::size_t i = 0; i < dark.size(); ++i) ASSERT_TRUE(i % 4 == 3 || dark[i] == 0.0F) << i;
}

// Nor does a dark light that turns, by itself or beside a bright one, with fixed cameras or without.
TEST(Changes, TheSameLightsChangeNothing) {
  for (const std::uint32_t fixed : {0U, 1U})
    for (const bool beside : {false, true}) {
      SmallScene scene;
      scene.settings.fixed_cameras = fixed;
      scene.lights = {SmallScene::light({0.5, 0.6, -0.6}, 0.0)};
      if (beside) scene.lights.push_back(SmallScene::light({1, 0.2, 0.4}, 1.5));
      const Handle r = planned(scene);
      frames(r.get(), 1);
      const Rgba before = gathered(r.get());
      for (const double x : {0.5, -0.5, 0.5}) {
        scene.lights[0].towards[0] = x;
        CALL(parian_set_lights(r.get(), scene.lights.size(), scene.lights.data()));
        EXPECT_EQ(summed(r.get()), 1U) << "light beside: " << beside << ", towards x: " << x;
        EXPECT_EQ(gathered(r.get()), before);
      }
      CALL(parian_frame(r.get(), nullptr, 0, nullptr, nullptr));
      if (beside) continue;
      scene.lights[0] = SmallScene::light({0.5, 0.6, -0.6}, 3.0);
      CALL(parian_set_lights(r.get(), 1, scene.lights.data()));
      EXPECT_EQ(parian_frame(r.get(), nullptr, 0, nullptr, nullptr), PARIAN_NOT_PLANNED) << "it comes on";
    }
  // One that runs along all of a flat mesh has no maps either.
  SmallScene scene;
  scene.settings.fixed_cameras = 1;
  for (std::size_t i = 1; i < scene.positions.size(); i += 3) scene.positions[i] = 0.0F;
  scene.lights = {SmallScene::light({1, 0, 0}, 3.0), SmallScene::light({0, 1, 0.2}, 1.5)};
  const Handle r = planned(scene);
  frames(r.get(), 1);
  const Rgba before = gathered(r.get());
  for (parian_light& l : scene.lights)
    for (double& e : l.irradiance) e *= 2.0;
  CALL(parian_set_lights(r.get(), 2, scene.lights.data()));
  EXPECT_EQ(gathered(r.get()), scaled(before, {2.0F, 2.0F, 2.0F}));
  scene.lights[0].towards[1] = 1.0;
  CALL(parian_set_lights(r.get(), 2, scene.lights.data()));
  EXPECT_EQ(parian_frame(r.get(), nullptr, 0, nullptr, nullptr), PARIAN_NOT_PLANNED) << "it doesn't any more";
}

TEST(Changes, DirectionStartsAnew) {
  SmallScene scene;
  scene.settings.light_map_size = 128;
  const auto turned = [&](std::array<double, 3> towards) { return SmallScene::light(towards, 3.0); };
  const parian_light a = turned({0.5, 0.6, -0.6}), b = turned({-0.7, 0.5, -0.3}), c = turned({0, 1, 0});
  const auto light = [](parian_renderer* r, const parian_light& l) {
    ASSERT_EQ(parian_set_lights(r, 1, &l), PARIAN_SUCCESS);
  };
  const Handle direct = planned(scene), detour = planned(scene);
  light(direct.get(), b);
  frames(direct.get(), 2);
  frames(detour.get(), 20);  // light maps have been shifted by now
  light(detour.get(), c);
  frames(detour.get(), 1);
  light(detour.get(), a);
  light(detour.get(), b);
  frames(detour.get(), 2);
  EXPECT_EQ(summed(detour.get()), 2U);
  EXPECT_EQ(gathered(detour.get()), gathered(direct.get()));
  frames(direct.get(), 62);
  scene.lights = {b};
  // The map of a turned light holds the bounding sphere, not the mesh alone: other texels, the same light.
  const double difference = relmse(gathered(direct.get(), nullptr, 8), [&] {
    const Handle r = planned(scene);
    frames(r.get(), 64);
    return gathered(r.get(), nullptr, 8);
  }());
  RecordProperty("relmse", std::to_string(difference));
  EXPECT_LE(difference, 2e-3);
}

TEST(Changes, MaterialAndSeedStartAnew) {
  SmallScene scene;
  const Handle r = planned(scene);
  frames(r.get(), 3);
  const Rgba first = gathered(r.get());
  scene.settings.seed = 5;
  CALL(parian_set_settings(r.get(), &scene.settings));
  CALL(parian_plan(r.get(), nullptr));
  EXPECT_EQ(summed(r.get()), 0U);
  frames(r.get(), 3);
  const Rgba seeded = gathered(r.get());
  EXPECT_NE(seeded, first);
  EXPECT_EQ(seeded, fresh(scene, 3));
  for (double& s : scene.material.sigma_s) s *= 0.5;
  CALL(parian_set_material(r.get(), &scene.material));
  CALL(parian_plan(r.get(), nullptr));
  frames(r.get(), 2);
  EXPECT_EQ(gathered(r.get()), fresh(scene, 2));
}

TEST(Changes, RestartForgetsEverything) {
  SmallScene scene;
  const Handle r = planned(scene);
  frames(r.get(), 20);
  double relative = 0.0;
  CALL(parian_estimate(r.get(), nullptr, &relative));
  CALL(parian_restart(r.get()));
  EXPECT_EQ(read_after(r.get(), 2), right_image());
}

}  // namespace
}  // namespace parian::test
