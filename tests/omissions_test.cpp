// What is left out: each omission alone shows the picture that keeping it shows, and saves what it says that it saves.
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>

#include "test_render.hpp"

namespace parian::test {
namespace {

struct Rendering {
  Image image;
  Statistics statistics;
  KernelTable kernels;
  int estimates = 0;
};

Rendering run(const Scene& scene, const Settings& settings, std::uint32_t frames) {
  Renderer renderer = renderer_of(scene, settings);
  Rendering r;
  while (renderer.frames() < frames) {
    renderer.frame();
    if (!renderer.checkpoint()) continue;
    renderer.estimate();
    ++r.estimates;
  }
  r.image = renderer.image(0);
  r.statistics = renderer.statistics();
  r.kernels = renderer.kernel_table();
  return r;
}

double launches(const Rendering& r, Stage stage, const char* kernel) {
  const auto found = r.kernels.find({stage, kernel});
  return found == r.kernels.end() ? 0.0 : static_cast<double>(found->second.launches);
}

/// What a run has spent of that which an omission counts.
double spent(const Rendering& r, const std::string& unit) {
  if (unit == "evaluations") return r.statistics.evaluations;
  if (unit == "bytes") return static_cast<double>(r.statistics.bytes_peak);
  if (unit == "layers") return r.statistics.layers_count;
  if (unit == "light maps") return launches(r, Stage::light_map, "light_map_resolve");
  if (unit == "draws") return launches(r, Stage::gather, "raster_depth_large");
  if (unit == "levels") return launches(r, Stage::pyramids, "pyramids_level");
  if (unit == "estimates") return r.estimates;
  return NAN;
}

double omitted(const Rendering& r, const std::string& what, std::string* unit = nullptr) {
  double count = 0.0;
  for (const Omission& o : r.statistics.left_out) {
    if (o.what != what) continue;
    count += o.count;
    if (unit) *unit = o.unit;
  }
  return count;
}

struct Case {
  const char* what;
  double of_noise;  // of which part of the expected noise the pictures may differ; 0: in no bit
  std::function<void(Scene&, Settings&)> change;
  std::uint32_t frames = 3;
};

constexpr double no_bit = 0, little = 0.01, noise_alone = 2;

void face_on(Scene& scene) {  // of a box, one face is seen
  scene.mesh = box({20, 20, 20});
  scene.cameras[0].eye = {0, 0, 110};
}

const std::vector<Case>& cases() {
  static const std::vector<Case> table{
      {"equal-channels", no_bit, [](Scene& s, Settings&) { s.material = material(2.0, 0.01); }},
      {"black-channels", no_bit, [](Scene& s, Settings&) { s.material.sigma_s.y = 0.0; }},
      {"dark-lights", no_bit,
       [](Scene& s, Settings&) {  // before others, whose samples must not change
         s.lights.insert(s.lights.begin(), {{-0.3, 0.2, 1.0}, glm::dvec3(0.0)});
         s.lights.push_back({{-0.8, 0.35, 0.5}, glm::dvec3(1.0)});
       }},
      {"clipping", no_bit, [](Scene&, Settings&) {}},
      {"height-pyramids", no_bit,
       [](Scene& s, Settings& settings) {
         s.lights[0].towards = {0.2, 0.3, 1.0};
         settings.estimator = Estimator::radial;
       }},
      // More layers average more texels.
      {"redundant-layers", noise_alone,
       [](Scene& s, Settings& settings) {
         s.mesh = box({60, 40, 20});
         settings.keep = {"idle-layers"};  // or some of them go all the same
         settings.pyramids = false;        // blur isn't noise
       },
       16},
      // A texel that is read between the marked subpixel positions is not there, and its neighbours count for more.
      {"unread-texels", little, [](Scene&, Settings& settings) { settings.pyramids = false; }},
      {"idle-layers", no_bit, [](Scene& s, Settings&) { face_on(s); }},
      // Texels lie elsewhere, and so do samples.
      {"layers", noise_alone,
       [](Scene&, Settings& settings) {
         settings.gather = Gather::automatic;
         settings.keep = {"idle-layers"};
         settings.pyramids = false;
       },
       16},
      {"pyramids", no_bit, [](Scene&, Settings&) {}},
      // 8 subpixel positions of a smooth surface instead of 64.
      {"interior-positions", little, [](Scene&, Settings&) {}},
      // Which level is shown may depend on when it was chosen; without levels nothing does.
      {"checkpoints", no_bit,
       [](Scene&, Settings& settings) {
         settings.pyramids = false;
         settings.error = 1e-5;
       },
       8},
      {"camera-redraws", no_bit, [](Scene&, Settings&) {}},
      {"light-map-redraws", no_bit, [](Scene&, Settings&) {}},
  };
  return table;
}

bool same_coverage(const Image& a, const Image& b) {
  for (std::size_t i = 3; i < a.rgba.size(); i += 4)
    if (a.rgba[i] != b.rgba[i]) return false;
  return true;
}

void check(const Case& c) {
  Scene scene = bare_scene(model("torus"), find_material("marble"));
  Settings settings = small_settings();
  c.change(scene, settings);
  Settings keep = settings;
  keep.keep.insert(c.what);
  const Rendering without = run(scene, settings, c.frames), with = run(scene, keep, c.frames);

  std::string unit;
  const double said = omitted(without, c.what, &unit);
  const double saved = spent(with, unit) - spent(without, unit);
  const double error = relmse(without.image, with.image);
  const double noise = without.statistics.estimated_relmse + with.statistics.estimated_relmse;
  fmt::print("{}: saves {:.0f} {}, measured {:.0f}; relMSE {:.2g}, expected of noise {:.2g}\n", c.what, said, unit,
             saved, error, noise);
  EXPECT_GT(said, 0.0) << c.what;
  EXPECT_EQ(omitted(with, c.what), 0.0) << c.what;
  if (unit == "bytes" && std::string(c.what) != "idle-layers") {  // these are there until it's known that they idle
    EXPECT_GE(saved, said) << c.what;
  } else if (std::string(c.what) == "unread-texels") {
    EXPECT_NEAR(saved / said, 1.0, 0.01) << "pixels that no layer sees are another few";
  } else if (unit == "look-ups") {  // nothing counts those made: 56 at each pixel of the inside, no more
    EXPECT_LE(said, 56.0 * static_cast<double>(pixels_inside(without.image))) << c.what;
    EXPECT_GT(said, 28.0 * static_cast<double>(pixels_inside(without.image))) << c.what;
  } else if (unit != "bytes") {
    EXPECT_EQ(saved, said) << c.what;
  }

  EXPECT_TRUE(same_coverage(without.image, with.image)) << c.what;
  if (c.of_noise == no_bit) {
    EXPECT_TRUE(same_bits(without.image, with.image)) << c.what << ": " << difference(without.image, with.image);
  } else {
    EXPECT_LT(error, c.of_noise * noise) << c.what;
  }
}

TEST(Omissions, EachAloneShowsTheSamePicture) {
  for (const Case& c : cases()) check(c);
}

TEST(Omissions, AllAreTried) {
  for (const char* name : omission_names)
    EXPECT_EQ(std::count_if(cases().begin(), cases().end(), [&](const Case& c) { return c.what == std::string(name); }),
              1)
        << name;
}

// Before the first frame and after the last, `--explain` and `--stats` name the same for the same reasons.
TEST(Omissions, ExplanationAndStatisticsAgree) {
  Renderer renderer = renderer_of(bare_scene(model("torus"), material(2.0, 0.01)), small_settings());
  const auto explain = [&] { return fmt::format("{}", fmt::join(renderer.explanation(), "\n")); };
  const std::string before = explain();
  for (int i = 0; i < 3; ++i) renderer.frame();
  (void)renderer.image(0);
  const std::string after = explain();
  for (const Omission& o : renderer.statistics().left_out) {
    const std::string line = fmt::format("left out  {}: {}; saves ", o.what, o.why);
    EXPECT_NE(before.find(line), std::string::npos) << line;
    EXPECT_NE(after.find(line), std::string::npos) << line;
  }
}

TEST(Omissions, ExplanationSaysWhetherThereAreGuides) {
  Scene scene = bare_scene(model("torus"), find_material("marble"), {512, 512});
  Settings settings = small_settings();
  settings.gather = Gather::camera;
  settings.light_map_size = 32;
  const auto explain = [&] {
    const Renderer renderer = renderer_of(scene, settings);
    return fmt::format("{}", fmt::join(renderer.explanation(), "\n"));
  };
  EXPECT_NE(explain().find("; guides of samples in up to 1024 tiles a light"), std::string::npos) << explain();
  scene.lights.assign(24, scene.lights[0]);  // 25 kB a light and tile
  EXPECT_NE(explain().find("; no guides of samples, which would take more than 512 MiB"), std::string::npos)
      << explain();
  settings.estimator = Estimator::radial;
  EXPECT_EQ(explain().find("guides"), std::string::npos) << explain();
}

// A flat object seen edge-on by a light gets none of it: the other light has all the samples.
TEST(Omissions, LightAlongTheSurface) {
  Scene scene =
      bare_scene(mesh_of({{-30, -20, 0}, {30, -25, 0}, {0, 30, 0}}, {0, 1, 2}), find_material("marble"), {32, 32});
  scene.lights = {{{0, 0, 1}, glm::dvec3(1.0)}};
  const Rendering alone = run(scene, small_settings(), 2);
  scene.lights.push_back({{0.6, 0.8, 0}, glm::dvec3(5.0)});
  const Rendering both = run(scene, small_settings(), 2);
  EXPECT_GT(omitted(both, "dark-lights"), 0.0);
  EXPECT_GT(mean_value(alone.image), 0.0);
  EXPECT_TRUE(same_bits(alone.image, both.image)) << difference(alone.image, both.image);
}

// One view of a grey object needs a third of the evaluations for its channels, and less than half of the texels.
TEST(Omissions, GreyStillTakesASixth) {
  const Scene scene = bare_scene(model("figure"), material(2.0, 0.01), {128, 128});
  for (const Gather gather : {Gather::layers, Gather::automatic}) {
    const auto evaluations = [&](const std::set<std::string>& keep) {
      Settings settings = small_settings();
      settings.layers = 16;
      settings.layer_size = 96;
      settings.gather = gather;
      settings.keep = keep;
      return run(scene, settings, 2).statistics.evaluations;
    };
    const double least = evaluations({}), most = evaluations({"all"}), channels = evaluations({"equal-channels"});
    const double texels = gather == Gather::layers ? evaluations({"unread-texels"}) : NAN;
    fmt::print("{}: all {:.2f}, equal channels {:.4f}, unread texels {:.2f} times {:.4g} evaluations\n",
               gather == Gather::layers ? "layers" : "auto", most / least, channels / least, texels / least, least);
    EXPECT_GE(most, 6.0 * least);
    EXPECT_EQ(channels, 3.0 * least);
    if (gather == Gather::layers) {  // a camera's own view has no texels that aren't read
      EXPECT_GE(texels, 2.0 * least);
    }
  }
}

}  // namespace
}  // namespace parian::test
