// The estimated error: its formula on made-up halves, and whole renders against references of a hundred times the
// samples.
#include "render/estimate.hpp"

#include <algorithm>
#include <random>

#include "test_render.hpp"

namespace parian {
namespace {

using namespace test;

struct MadeUp {
  Halves shown, finest;
  [[nodiscard]] double estimate() const { return estimated_relmse(shown, finest); }
};

/// Halves of a flat picture with noise of variance `noise` in A and B, of `noise_0` in A0 and B0, and a blur that is
/// off by `blur`; level 0 is unbiased.
MadeUp made_up(std::size_t pixels, double noise, double noise_0, double blur, unsigned seed) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  MadeUp h;
  const auto draw = [&](double variance, double mean) {
    glm::vec3 v;
    for (int c = 0; c < 3; ++c) v[c] = static_cast<float>(mean + std::sqrt(variance) * normal(engine));
    return v;
  };
  for (std::size_t i = 0; i < pixels; ++i) {
    h.shown.a.push_back(draw(noise, 1.0 + blur));
    h.shown.b.push_back(draw(noise, 1.0 + blur));
    h.finest.a.push_back(draw(noise_0, 1.0));
    h.finest.b.push_back(draw(noise_0, 1.0));
    h.shown.alpha.push_back(1.0F);
    h.finest.alpha.push_back(1.0F);
  }
  return h;
}

TEST(Estimate, IsVariancePlusSquaredBlur) {
  // Standard error of the mean over 3e5 values: at most 0.8 %; C varies with A and B, which moves it by 0.2 %.
  EXPECT_NEAR(made_up(100000, 1e-4, 1e-4, 0.0, 1).estimate() / 5e-5, 1.0, 0.03);
  EXPECT_NEAR(made_up(100000, 1e-6, 1e-4, 0.1, 2).estimate() / (0.01 / 1.21), 1.0, 0.03);
  EXPECT_NEAR(made_up(100000, 1e-4, 1e-4, 0.1, 3).estimate() / (0.01005 / 1.21), 1.0, 0.03);
}

TEST(Estimate, Limits) {
  EXPECT_EQ(MadeUp().estimate(), 0.0);
  MadeUp h = made_up(100, 0.0, 0.0, 0.0, 1);
  EXPECT_EQ(h.estimate(), 0.0);
  h.shown.b[7].y = 3.0F;  // 1 + 1 of (3 - 1)^2 / 4 and (A - A0)(B - B0) = 0, over C^2 = 4
  EXPECT_NEAR(h.estimate(), 1.0 / 4.0 / 300.0, 1e-6);
  h.shown.alpha[7] = 0.9F;  // edges don't count
  EXPECT_EQ(h.estimate(), 0.0);
  for (float& alpha : h.shown.alpha) alpha = 0.9F;
  EXPECT_EQ(h.estimate(), -1.0);  // edges alone: not known
  for (float& alpha : h.shown.alpha) alpha = 0.0F;
  EXPECT_EQ(h.estimate(), 0.0);
  h = made_up(100, 0.0, 0.0, 0.0, 1);
  h.shown.a[3].x = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(h.estimate(), std::numeric_limits<double>::infinity());  // NaN never counts as converged
}

struct Case {
  const char* name;
  Scene scene;
  Settings settings;
  std::set<std::uint32_t> frames;  ///< when truth and estimate are compared
};

struct Honesty {
  double log_sum = 0.0, least = INFINITY, most = 0.0;
  int count = 0;
  void add(double ratio) {
    log_sum += std::log(ratio);
    least = std::min(least, ratio);
    most = std::max(most, ratio);
    ++count;
  }
  [[nodiscard]] double mean() const { return std::exp(log_sum / count); }
};

// True relMSE over estimated relMSE, of images as the command line writes them. The reference has 100 times the samples
// of the longest run and another seed; layers and film are the same, so that only sampling differs, which is what the
// estimate is of. The heavy tails of few samples and the noise in the estimate's own C leave a factor of two in the
// mean; one run on a few hundred pixels that share their layers' texels may be off by three. While the true relMSE is
// above some percent, the estimate is too low by more, since pixels that are too bright raise C^2 as well.
void expect_honest(const Case& c, std::uint32_t seeds) {
  const std::uint32_t longest = *c.frames.rbegin();
  Settings settings = c.settings;
  settings.pyramids = false;
  settings.seed = 4242;
  const std::uint32_t more = std::max(1U, 128 / settings.samples);
  settings.samples *= more;
  Renderer reference_renderer = renderer_of(c.scene, settings);
  while (reference_renderer.frames() * more < 100 * longest) reference_renderer.frame();
  const Image reference = reference_renderer.image(0);
  for (const bool pyramids : {false, true}) {
    std::map<std::uint32_t, Honesty> at;
    for (std::uint32_t seed = 0; seed < seeds; ++seed) {
      settings = c.settings;
      settings.pyramids = pyramids;
      settings.seed = seed;
      Renderer renderer = renderer_of(c.scene, settings);
      while (renderer.frames() < longest) {
        renderer.frame();
        if (renderer.checkpoint()) renderer.estimate();
        const std::uint32_t n = renderer.frames();
        if (!c.frames.contains(n)) continue;
        const Image image = renderer.image(0);
        const double truth = relmse(image, reference), estimated = renderer.statistics().estimated_relmse;
        at[n].add(truth / estimated);
        EXPECT_GT(truth / estimated, 1.0 / 3.0) << c.name << ", " << n << " frames, seed " << seed << ": " << truth;
        EXPECT_LT(truth / estimated, 3.0) << c.name << ", " << n << " frames, seed " << seed << ": " << truth;
        if (seed == 0)
          fmt::print("{}, {} pyramids, {:2} frames: {:.3g} true, {:.3g} estimated\n", c.name, pyramids ? "with" : "no",
                     n, truth, estimated);
      }
    }
    for (const auto& [n, honesty] : at) {
      fmt::print("{}, {} pyramids, {:2} frames: true / estimated {:.2f}, from {:.2f} to {:.2f}\n", c.name,
                 pyramids ? "with" : "no", n, honesty.mean(), honesty.least, honesty.most);
      EXPECT_GT(honesty.mean(), 0.5) << c.name << ", " << n;
      EXPECT_LT(honesty.mean(), 2.0) << c.name << ", " << n;
    }
  }
}

TEST(Estimate, IsHonestOfMarbleLitFromBehind) {
  const Scene scene = bare_scene(model("torus"), find_material("marble"));
  Settings settings = small_settings();
  if (!deep()) settings.layer_size = 48;
  expect_honest({"marble torus", scene, settings, {8, 32}}, 4);
}

// So noisy that coarser pyramid levels are shown.
TEST(Estimate, IsHonestOfFewSamples) {
  Settings settings = small_settings();
  settings.samples = 2;
  settings.layer_size = deep() ? 96 : 72;
  settings.layers = 8;
  const Scene scene = bare_scene(model("concave"), find_material("marble"));
  expect_honest({"2 samples, concave", scene, settings, {32, 64}}, 4);
}

TEST(Estimate, IsHonestOfSkinLitTwice) {
  Settings settings = small_settings();
  settings.light_map_size = 256;
  if (!deep()) settings.layer_size = 48;
  Scene scene = bare_scene(model("figure"), find_material("skin2"));
  scene.lights.push_back({{-0.8, 0.35, 0.5}, {0.5, 0.7, 1.5}});
  expect_honest({"skin2 figure", scene, settings, {2, 8}}, 3);
}

// Noise of the fewest samples that there can be becomes blur, and less error: a level between the finest and the
// coarsest is best. Texels smaller than a pixel, so that a coarse level has something to average; over many seeds.
TEST(Estimate, PyramidsHelpWhereSamplesAreFew) {
  const Scene scene = bare_scene(model("concave"), find_material("marble"));
  Settings settings = small_settings();
  settings.layer_size = 160;
  settings.pyramids = false;
  settings.samples = 512;
  const Image reference = render(scene, settings, 8).image;
  settings.samples = 2;
  double log_sum = 0.0;
  const std::uint32_t seeds = deep() ? 24 : 8;
  for (settings.seed = 1; settings.seed <= seeds; ++settings.seed)
    for (const std::uint32_t frames : {1U, 2U}) {
      double error[2] = {};
      for (const bool pyramids : {false, true}) {
        settings.pyramids = pyramids;
        error[pyramids] = relmse(render(scene, settings, frames).image, reference);
      }
      EXPECT_LT(error[1], error[0]) << "seed " << settings.seed << ", " << frames << " frames";
      if (frames == 1) log_sum += std::log(error[1] / error[0]);
    }
  const double ratio = std::exp(log_sum / seeds);
  fmt::print("a frame of 2 samples: relMSE with pyramids {:.3f} of that without, geometric mean\n", ratio);
  EXPECT_LT(ratio, 0.6);
}

}  // namespace
}  // namespace parian
