// Whole renders against themselves: what changes of unit, brightness, channel order and place may not change.
#include <algorithm>
#include <array>
#include <glm/gtc/matrix_transform.hpp>
#include <numeric>
#include <random>

#include "scratch.hpp"
#include "test_render.hpp"

namespace parian {
namespace {

using namespace test;

Scene marble_torus() { return bare_scene(model("torus"), find_material("marble")); }

// Powers of two change exponents only; the renderer's own unit is the object's radius. Tolerance: none.
TEST(Render, ScaledWorldIsTheSameToTheBit) {
  const Rendered r = render(marble_torus(), small_settings(), 4);
  expect_sane(r, "torus");
  for (const int k : {-3, 5, 20}) {
    const double factor = std::ldexp(1.0, k);
    Scene scene = marble_torus();
    for (auto& p : scene.mesh.positions) p *= factor;
    scene.material.sigma_s /= factor;
    scene.material.sigma_a /= factor;
    scene.cameras[0].eye *= factor;
    scene.cameras[0].target *= factor;
    const Rendered scaled = render(scene, small_settings(), 4);
    EXPECT_TRUE(same_bits(scaled.image, r.image)) << "2^" << k << ": " << difference(scaled.image, r.image);
    EXPECT_EQ(scaled.estimate, r.estimate) << "2^" << k;
  }
}

TEST(Render, BrighterLightScalesTheImageExactly) {
  const Rendered r = render(marble_torus(), small_settings(), 4);
  for (const int n : {-20, 3, 40}) {
    Scene scene = marble_torus();
    scene.lights[0].irradiance *= std::ldexp(1.0, n);
    Rendered scaled = render(scene, small_settings(), 4);
    expect_sane(scaled, fmt::format("irradiance x 2^{}", n));
    for (std::size_t i = 0; i < scaled.image.rgba.size(); ++i)
      if (i % 4 < 3) scaled.image.rgba[i] = std::ldexp(scaled.image.rgba[i], -n);
    EXPECT_TRUE(same_bits(scaled.image, r.image)) << "2^" << n << ": " << difference(scaled.image, r.image);
    EXPECT_EQ(scaled.estimate, r.estimate) << "2^" << n;
  }
}

glm::dvec3 permuted(glm::dvec3 v, std::array<int, 3> p) { return {v[p[0]], v[p[1]], v[p[2]]}; }

Scene permuted(Scene scene, std::array<int, 3> p) {
  scene.material.sigma_s = permuted(scene.material.sigma_s, p);
  scene.material.sigma_a = permuted(scene.material.sigma_a, p);
  scene.material.g = permuted(scene.material.g, p);
  for (auto& light : scene.lights) light.irradiance = permuted(light.irradiance, p);
  return scene;
}

Image permuted(const Image& image, std::array<int, 3> p) {
  Image result = image;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4)
    for (int c = 0; c < 3; ++c) result.rgba[i + c] = image.rgba[i + p[c]];
  return result;
}

/// Channels that differ in every coefficient, under light that differs too.
Scene colourful_torus() {
  Scene scene = marble_torus();
  scene.material.sigma_s = {1.4, 3.7, 2.2};
  scene.material.sigma_a = {0.004, 0.09, 0.02};
  scene.material.g = {0.2, 0.6, -0.1};
  scene.lights[0].irradiance = {4.0, 2.5, 1.25};
  return scene;
}

// Channels are put in an order of their own before anything depends on it. Tolerance: none. A turn and a swap make all
// orders; each is a program of its own, so that without the long form kinds other than the first are only turned.
TEST(Render, PermutedChannelsPermuteTheImageToTheBit) {
  for (const char* kind : {"three channels", "two equal", "one black"}) {
    Scene scene = colourful_torus();
    Material& m = scene.material;
    if (std::string(kind) == "two equal") m.sigma_s.z = m.sigma_s.x, m.sigma_a.z = m.sigma_a.x, m.g.z = m.g.x;
    if (std::string(kind) == "one black") m.sigma_s.y = 0.0;
    const Rendered r = render(scene, small_settings(), 2);
    for (const std::array<int, 3> p : {std::array{1, 2, 0}, std::array{0, 2, 1}}) {
      if (p[0] == 0 && std::string(kind) != "three channels" && !deep()) continue;
      const Rendered other = render(permuted(scene, p), small_settings(), 2);
      const Image expected = permuted(r.image, p);
      EXPECT_TRUE(same_bits(other.image, expected)) << kind << ": " << difference(other.image, expected);
      EXPECT_EQ(other.statistics.evaluations, r.statistics.evaluations) << kind;
    }
  }
}

double omitted(const Statistics& s, const std::string& what) {
  double count = 0.0;
  for (const Omission& o : s.left_out) count += o.what == what ? o.count : 0.0;
  return count;
}

// Equal channels share their value, black ones have none, and the density of samples rests on the distinct scattering
// channels whether or not the others are evaluated. Tolerance: none.
TEST(Render, ChannelsLeftOutChangeNoBit) {
  for (const char* kind : {"two equal", "all equal", "one black", "one black, two equal"}) {
    Scene scene = colourful_torus();
    Material& m = scene.material;
    const std::string k = kind;
    if (k != "one black") m.sigma_s.z = m.sigma_s.x, m.sigma_a.z = m.sigma_a.x, m.g.z = m.g.x;
    if (k == "all equal") m = material(2.0, 0.01);
    if (k.starts_with("one black")) m.sigma_s.y = 0.0;
    const Rendered r = render(scene, small_settings(), 2);
    Settings keep = small_settings();
    keep.keep = {"equal-channels", "black-channels"};
    const Rendered all = render(scene, keep, 2);
    EXPECT_TRUE(same_bits(r.image, all.image)) << kind << ": " << difference(r.image, all.image);
    const double saved = all.statistics.evaluations - r.statistics.evaluations;
    EXPECT_GT(saved, 0.0) << kind;
    EXPECT_EQ(omitted(r.statistics, "equal-channels") + omitted(r.statistics, "black-channels"), saved) << kind;
    EXPECT_EQ(omitted(all.statistics, "equal-channels") + omitted(all.statistics, "black-channels"), 0.0) << kind;
  }
}

// Nothing that is left out changes what the image converges to. With everything kept, layers are numbered anew and so
// draw other samples, and more texels are read at edges: noise may differ, the mean by noise only.
TEST(Render, EverythingKeptIsTheSamePicture) {
  Scene scene = marble_torus();
  scene.lights.push_back({{-0.3, 0.2, 1.0}, glm::dvec3(0.0)});
  Settings keep = small_settings();
  keep.keep = {"all"};
  keep.pyramids = false;
  Settings without = small_settings();
  without.pyramids = false;
  const Rendered a = render(scene, without, 32), b = render(scene, keep, 32);
  EXPECT_GT(b.statistics.evaluations, 2.0 * a.statistics.evaluations);
  EXPECT_GE(b.statistics.bytes_peak, a.statistics.bytes_peak);
  EXPECT_TRUE(b.statistics.left_out.empty());
  const double error = relmse(a.image, b.image);
  const double expected = a.statistics.estimated_relmse + b.statistics.estimated_relmse;
  fmt::print("all kept: relMSE {:.3g} of {:.3g} expected, means {:.6g} {:.6g}\n", error, expected, mean_value(a.image),
             mean_value(b.image));
  EXPECT_LT(error, 2.0 * expected);
  EXPECT_NEAR(mean_value(a.image) / mean_value(b.image), 1.0, 0.003);
}

/// Mean and variance of each value over seeds.
struct Sampled {
  std::vector<double> mean, variance_of_mean;
  std::vector<float> alpha;
};

Sampled sample(const Scene& scene, Settings settings, std::uint32_t frames, std::uint32_t first_seed) {
  constexpr std::uint32_t seeds = 8;
  Sampled s;
  std::vector<double> squares;
  for (std::uint32_t i = 0; i < seeds; ++i) {
    settings.seed = first_seed + i;
    const Rendered r = render(scene, settings, frames);
    expect_sane(r, "seed");
    s.mean.resize(r.image.rgba.size());
    squares.resize(r.image.rgba.size());
    s.alpha.resize(r.image.rgba.size() / 4);
    for (std::size_t k = 0; k < s.mean.size(); ++k) {
      s.mean[k] += double{r.image.rgba[k]} / seeds;
      squares[k] += double{r.image.rgba[k]} * r.image.rgba[k] / seeds;
      if (k % 4 == 3) s.alpha[k / 4] = r.image.rgba[k];
    }
  }
  for (std::size_t k = 0; k < s.mean.size(); ++k)
    s.variance_of_mean.push_back(std::max(squares[k] - s.mean[k] * s.mean[k], 0.0) / (seeds - 1));
  return s;
}

/// Mean z^2 of two sampled images where both are inside, and the ratio of their means.
std::pair<double, double> compare(const Sampled& a, const Sampled& b) {
  double z2 = 0.0, count = 0.0, sum_a = 0.0, sum_b = 0.0;
  for (std::size_t k = 0; k < a.mean.size(); ++k) {
    if (k % 4 == 3 || a.alpha[k / 4] < fully_covered || b.alpha[k / 4] < fully_covered) continue;
    const double d = a.mean[k] - b.mean[k];
    z2 += d * d / (a.variance_of_mean[k] + b.variance_of_mean[k]);
    count += 1.0;
    sum_a += a.mean[k];
    sum_b += b.mean[k];
  }
  return {z2 / count, sum_a / sum_b};
}

// From 8 seeds a side, z^2 of pure noise averages 14/12 (Student's t); 1.5 leaves room for pixels that share layer
// texels and so don't average out independently.
constexpr double largest_z2 = 1.5;
constexpr double mean_tolerance = 0.003;  // the noise of the means is a tenth of it

TEST(Render, TwoLightsAreTheSumOfEachAlone) {
  Scene scene = bare_scene(model("torus"), find_material("marble"), {48, 48});
  const DirectionalLight first{{0.5, 0.6, -0.6}, {3.0, 2.0, 1.0}}, second{{-0.8, 0.35, 0.5}, {0.5, 0.7, 1.5}};
  Settings settings = small_settings();
  settings.pyramids = false;
  scene.lights = {first};
  Sampled sum = sample(scene, settings, 4, 0);
  scene.lights = {second};
  const Sampled other = sample(scene, settings, 4, 100);
  for (std::size_t k = 0; k < sum.mean.size(); ++k) {
    sum.mean[k] += other.mean[k];
    sum.variance_of_mean[k] += other.variance_of_mean[k];
  }
  scene.lights = {first, second};
  const auto [z2, ratio] = compare(sample(scene, settings, 4, 200), sum);
  fmt::print("two lights: mean z^2 {:.3f}, means' ratio {:.5f}\n", z2, ratio);
  EXPECT_LT(z2, largest_z2);
  EXPECT_NEAR(ratio, 1.0, mean_tolerance);
}

// Layers and light maps then lie elsewhere on the object, so that interpolation differs: the noise of 2 frames of 4
// samples hides that from z^2, but not from the mean.
TEST(Render, RotatedWorldLooksTheSame) {
  const Scene scene = bare_scene(model("torus"), find_material("marble"), {48, 48});
  Settings settings = small_settings();
  settings.pyramids = false;
  settings.layer_size = 96;
  settings.light_map_size = 256;
  settings.samples = 4;
  Scene turned = scene;
  const glm::dmat3 m(glm::rotate(glm::dmat4(1.0), 0.7, glm::normalize(glm::dvec3(0.3, 1.0, -0.4))));
  for (auto& p : turned.mesh.positions) p = m * p;
  for (auto& n : turned.mesh.normals) n = glm::vec3(m * glm::dvec3(n));
  for (auto& light : turned.lights) light.towards = m * light.towards;
  turned.cameras[0].eye = m * turned.cameras[0].eye;
  turned.cameras[0].up = m * turned.cameras[0].up;
  const auto [z2, ratio] = compare(sample(scene, settings, 2, 0), sample(turned, settings, 2, 100));
  fmt::print("rotated: mean z^2 {:.3f}, means' ratio {:.5f}\n", z2, ratio);
  EXPECT_LT(z2, largest_z2);
  EXPECT_NEAR(ratio, 1.0, mean_tolerance);
}

// Ids break ties only, on edges where two triangles have the same depth.
TEST(Render, OrderOfTrianglesDoesNotMatter) {
  Scene scene = bare_scene(model("concave"), find_material("marble"));
  const Rendered r = render(scene, small_settings(), 4);
  std::vector<std::size_t> order(scene.mesh.triangles.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::shuffle(order.begin(), order.end(), std::mt19937(5));
  const Mesh mesh = scene.mesh;
  for (std::size_t i = 0; i < order.size(); ++i) {
    scene.mesh.triangles[i] = mesh.triangles[order[i]];
    for (std::size_t c = 0; c < 3; ++c) scene.mesh.normals[3 * i + c] = mesh.normals[3 * order[i] + c];
  }
  const Rendered shuffled = render(scene, small_settings(), 4);
  const double error = relmse(shuffled.image, r.image);
  fmt::print("shuffled: relMSE {:.3g}, {}\n", error, difference(shuffled.image, r.image));
  EXPECT_LT(error, 1e-8);
}

TEST(Render, SameSceneTwiceIsTheSameToTheBit) {
  Scene scene = bare_scene(model("concave"), find_material("skin2"));
  scene.lights.push_back({{-0.8, 0.35, 0.5}, {0.5, 0.7, 1.5}});
  const Rendered a = render(scene, small_settings(), 4), b = render(scene, small_settings(), 4);
  EXPECT_TRUE(same_bits(a.image, b.image)) << difference(a.image, b.image);
  EXPECT_EQ(a.estimate, b.estimate);
  EXPECT_EQ(a.statistics.estimated_relmse, b.statistics.estimated_relmse);
  Settings other = small_settings();
  other.seed = 1;
  EXPECT_FALSE(same_bits(a.image, render(scene, other, 4).image));
}

// Looking at the image or at the estimate in between changes nothing that comes later, except the level that the
// estimate chose.
TEST(Render, LookingInBetweenChangesNothing) {
  Settings settings = small_settings();
  settings.pyramids = false;
  Renderer a = renderer_of(marble_torus(), settings), b = renderer_of(marble_torus(), settings);
  for (int i = 0; i < 5; ++i) {
    a.frame();
    b.frame();
    b.estimate();
    b.image(0);
  }
  const Image seen = b.image(0), unseen = a.image(0);
  EXPECT_TRUE(same_bits(seen, unseen)) << difference(seen, unseen);
}

// With Gather::camera every view is a layer of its own, whatever else is drawn between its frames.
TEST(Render, ViewsByCameraAreAsEachAlone) {
  Scene scene = marble_torus();
  Camera second = scene.cameras[0];
  second.eye = {second.eye.z, second.eye.y, -second.eye.x};
  scene.cameras.push_back(second);
  Settings settings = small_settings();
  settings.gather = Gather::camera;
  Renderer both = renderer_of(scene, settings);
  for (int i = 0; i < 5; ++i) both.frame();
  for (std::size_t camera = 0; camera < 2; ++camera) {
    Scene one = scene;
    one.cameras = {scene.cameras[camera]};
    const Image alone = render(one, settings, 5).image, together = both.image(camera);
    EXPECT_TRUE(same_bits(alone, together)) << "camera " << camera << ": " << difference(alone, together);
    EXPECT_GT(mean_value(alone), 0.0);
  }
}

TEST(Render, CommandLineWritesTheSameBytesTwice) {
  const Scratch scratch;
  std::string bytes[2];
  for (int i = 0; i < 2; ++i) {
    const auto file = scratch / fmt::format("picture{}.exr", i);
    const std::string command = fmt::format(
        "'" PARIAN_BINARY "' render '" PARIAN_MESHES
        "/torus.ply' -o '{}' --size 48x48 --layers 8 --layer-size 48 --light-map-size 128 --frames 3 --quiet",
        file.string());
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
    bytes[i] = read_bytes(file);
  }
  EXPECT_GT(bytes[0].size(), 1000U);
  EXPECT_TRUE(bytes[0] == bytes[1]);
}

}  // namespace
}  // namespace parian
