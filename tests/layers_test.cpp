// Pass 2: the same samples in double, the average over many frames against quadrature, and the same bits twice.
#include <gtest/gtest.h>
#include <algorithm>
#include <bit>
#include <numeric>
#include <span>

#include "exact_samples.hpp"
#include "kernels/sampling.h"
#include "test_lit.hpp"

namespace parian::test {
namespace {

using kernels::float4;

struct Case {
  const char* name;
  int lanes, estimator;
  Material material;
  bool unit_lights = false;  // sums of each light, and other colours after them
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name << " on " << c.lanes << " lanes"; }

class LayersReplay : public testing::TestWithParam<Case> {};

TEST_P(LayersReplay, SameSamplesInDouble) {
  const Case& c = GetParam();
  LitBench b(c.material, {light_a, light_b}, 100, true, fitted(4U, 6U), [&](Plan& p) {
    set_option(p.options, "VW", c.lanes);
    p.lanes = static_cast<std::uint32_t>(c.lanes);
    set_option(p.options, "ESTIMATOR", c.estimator);
    p.guides = c.estimator == 0;
    p.lights[0].samples = 5, p.lights[1].samples = 3;
    p.unit_lights = c.unit_lights;
  });
  b.passes.seed = 12345;
  if (c.unit_lights) b.passes.light_maps.given[0].irradiance = {0, 7.3, 1e5};
  constexpr std::uint32_t rounds = 3;
  const std::vector<float4> values = b.frames(rounds);
  Worst worst, worst_relative;
  double brightest = 0;
  int guided = 0;
  std::vector<double> relative;
  for (std::size_t i = 0; i < b.n; ++i)
    for (std::uint32_t half = 0; half < 2; ++half) {
      Replay r;
      for (std::uint32_t round = 0; round < rounds; ++round)
        for (std::size_t l = 0; l < 2; ++l) LightAtPoint(b, c.estimator, i, half, l).add(round, r);
      guided += r.guided;
      for (int channel = 0; channel < 3; ++channel) {
        const double found = exact(values[2 * i + half])[channel], error = std::fabs(found - r.sum[channel]);
        brightest = std::max(brightest, found);
        // S_d itself in float32: 5e-5 (its own test's bound for 99.9 % of cases), beside what its inputs' rounding
        // does.
        const double tolerance = 2e-5 * r.absolute[channel] + r.allowed[channel] + 1e-30;
        if (r.sum[channel] > 0) relative.push_back(error / r.sum[channel]);
        if (r.sum[channel] > 1e-6 * brightest) worst_relative.add(relative.back(), "");
        worst.add(error / tolerance, [&] {
          return fmt::format("point {} {} half {} channel {}: {:a}, expected {:a}", i, hex(exact(b.at[2 * i])), half,
                             channel, found, r.sum[channel]);
        });
      }
    }
  ASSERT_FALSE(relative.empty());
  std::sort(relative.begin(), relative.end());
  // In thin media light spreads farther than the object is wide, and all points are near to what is lit.
  const bool near = c.name == std::string("thin") || c.material.sigma_s == one_medium.sigma_s;
  EXPECT_EQ(guided > 0, c.estimator == 0 && !near);
  fmt::print(
      "{} VW={}: {} values, {} samples guided, relative error median {:.2g}, 99 % {:.2g}, worst {:.2g}; of tolerance "
      "{:.2f} ({})\n",
      c.name, c.lanes, relative.size(), guided, relative[relative.size() / 2], relative[relative.size() * 99 / 100],
      worst_relative.value, worst.value, worst.where);
  EXPECT_GT(brightest, 0);
  // 1e-6 and less unless the object is thousands of free paths wide, where float32 positions round to 1e-4 of a path.
  EXPECT_LE(relative[relative.size() / 2], 4e-5);
  EXPECT_LE(worst.value, 1) << worst.where;
}

INSTANTIATE_TEST_SUITE_P(
    LanesAndEstimators, LayersReplay,
    testing::Values(Case{"nearest", 1, 0, two_media}, Case{"nearest", 4, 0, two_media}, Case{"nearest", 8, 0, dense},
                    Case{"nearest", 16, 0, two_media}, Case{"exponential", 1, 1, one_medium},
                    Case{"exponential", 8, 1, two_media}, Case{"disc", 4, 2, two_media},
                    Case{"disc", 16, 2, one_medium}, Case{"clear", 8, 0, medium({1, 2, 3}, {0, 0, 0}, 1.3)},
                    Case{"nearly_opaque", 8, 0, medium({1e3, 2e3, 3e3}, {1, 2, 50}, 1.5)},
                    Case{"thin", 8, 0, medium({1e-3, 2e-3, 1e-2}, {1e-5, 1e-4, 1e-3}, 1.3)},
                    Case{"absorbing", 8, 0, medium({0.1, 0.2, 1}, {2, 3, 9}, 1.3)},
                    Case{"index_matched", 8, 0, medium({1, 2, 3}, {0.1, 0.2, 0.1}, 1.0)},
                    Case{"rarer_inside", 8, 0, medium({1, 2, 3}, {0.1, 0.2, 0.1}, 0.8)},
                    Case{"exponential_clear", 8, 1, medium({1, 2, 3}, {0, 0, 0}, 1.3)},
                    Case{"own_sums", 1, 0, two_media, true}, Case{"own_sums", 16, 0, one_medium, true}),
    [](const auto& tested) { return fmt::format("{}_{}_{}", tested.param.name, tested.param.lanes, tested.index); });

struct MeanCase {
  const char* name;
  int estimator;
  Material material;
  std::uint32_t frames, samples = 8;
};

void PrintTo(const MeanCase& c, std::ostream* out) { *out << c.name; }

class LayersMean : public testing::TestWithParam<MeanCase> {};

TEST_P(LayersMean, AgreesWithQuadrature) {
  const MeanCase& c = GetParam();
  LitBench b(c.material, {light_a}, 48, false, 40, [&](Plan& p) {
    set_option(p.options, "ESTIMATOR", c.estimator);
    p.guides = c.estimator == 0;
    p.density.parameters.radius = 2.05F;  // around any point, the whole object
    p.lights[0].samples = c.samples;
  });
  constexpr int seeds = 40;
  std::vector<glm::dvec3> sum(b.n), squares(b.n);
  for (int seed = 0; seed < seeds; ++seed) {
    b.passes.seed = 100 + seed;
    const std::vector<float4> values = b.frames(c.frames);
    for (std::size_t i = 0; i < b.n; ++i) {
      const glm::dvec3 v = exact(values[2 * i]) / double(c.frames);  // half A: the map that quadrature reads
      sum[i] += v, squares[i] += v * v;
    }
  }
  Worst worst;
  double z2 = 0, precision = 0;
  for (std::size_t i = 0; i < b.n; ++i) {
    const glm::dvec3 truth =
        quadrature(b.plan, b.passes.light_maps.lights[0], b.map, exact(b.at[2 * i]), exact(b.at[2 * i + 1]));
    for (int channel = 0; channel < 3; ++channel) {
      const double mean = sum[i][channel] / seeds;
      const double variance = std::max(squares[i][channel] / seeds - mean * mean, 0.0) / (seeds - 1);
      // Midpoints of cells a tenth of their distance wide leave about 1e-3 of the integral.
      const double error = std::sqrt(variance + std::pow(5e-4 * truth[channel], 2));
      const double z = std::fabs(mean - truth[channel]) / error;
      z2 += z * z, precision += std::sqrt(variance) / truth[channel];
      worst.add(z, [&] {
        return fmt::format("point {} channel {}: {:.6g} +- {:.2g}, expected {:.6g}", hex(exact(b.at[2 * i])), channel,
                           mean, error, truth[channel]);
      });
    }
  }
  const double count = 3.0 * double(b.n);
  fmt::print(
      "{}: {} points, standard error {:.2g}, mean square of deviations {:.2f}, worst {:.2f} standard errors ({})\n",
      c.name, b.n, precision / count, z2 / count, worst.value, worst.where);
  EXPECT_LE(worst.value, 4.0) << worst.where;
  EXPECT_LE(z2 / count, 2.0);
  EXPECT_LE(precision / count, 0.02);
}

INSTANTIATE_TEST_SUITE_P(
    Estimators, LayersMean,
    testing::Values(MeanCase{"nearest_marble", 0, medium({60, 75, 90}, {0.06, 0.12, 0.2}), 128},
                    MeanCase{"nearest_sparse", 0, two_media, 128}, MeanCase{"nearest_odd", 0, two_media, 1, 255},
                    MeanCase{"exponential_sparse", 1, two_media, 64},
                    MeanCase{"disc_sparse", 2, medium({0.4, 0.3, 0.3}, {0.02, 0.01, 0.02}, 1.3), 192}),
    [](const auto& tested) { return tested.param.name; });

TEST(Layers, PointsAreNumberedBlockByBlock) {
  const LitBench b(two_media, {light_a}, 100, false, 7, {});
  for (std::size_t i = 0; i < b.n; ++i) {
    const cl_uint s = b.side, layer = b.needed[i] / (s * s), x = b.needed[i] % s, y = b.needed[i] / s % s;
    ASSERT_EQ(std::bit_cast<std::uint32_t>(b.at[2 * i].w) ^ 0x40000000U, kernels::point_number(layer, s, s, x, y));
  }
}

// Which texels are needed changes no sample of those that are.
TEST(Layers, SamplesDoNotDependOnWhatElseIsNeeded) {
  const auto lights = fitted(std::vector{light_a, light_b}, std::vector{light_a});
  LitBench all(two_media, lights, 100, false, fitted(1U, 3U), {}),
      some(two_media, lights, 100, false, fitted(5U, 15U), {});
  const std::vector<float4> of_all = all.frames(2), of_some = some.frames(2);
  for (std::size_t i = 0; i < some.n; ++i)  // every fifth
    for (std::size_t half = 0; half < 2; ++half)
      ASSERT_EQ(exact(of_some[2 * i + half]), exact(of_all[2 * 5 * i + half])) << i;
}

TEST(Layers, HoldTheSurfaceInTheirOwnFrame) {
  const std::uint32_t size = fitted(40U, 20U), texels = size * size;
  Bench b(scene_of(torus(32, 16)));
  std::vector<kernels::View> views;
  for (const glm::dvec3& d : even_directions(5)) views.push_back(orthographic_view(b.points, d, size));
  make_layers(b.passes, views, false);
  const std::vector<float4> geometry = b.compute.read<float4>(b.passes.layers.geometry, 5 * texels);
  const std::vector<cl_uint> ids = b.compute.read<cl_uint>(b.passes.layers.ids, 5 * texels);
  Worst normal, height;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (ids[i] == 0xffffffffU) continue;
    const ExactView view(views[i / texels]);
    const std::size_t t = i % texels, row = t / size;
    const Hit h = hit_triangle(b, ids[i], view, double(t % size) + 0.5, double(row) + 0.5);
    if (h.inside() < 1e-3 || h.cosine < 1e-2) continue;  // the device moves it onto the triangle
    const std::string where = fmt::format("layer {} texel {}", i / texels, t);
    normal.add(glm::length(exact(geometry[i]) - view.frame(h.n_g)), where);
    height.add(std::fabs(geometry[i].w - view.film(h.x).z) * h.cosine, where);
  }
  fmt::print("layers: normals {:.2g} ({}), nearness {:.2g} ({})\n", normal.value, normal.where, height.value,
             height.where);
  EXPECT_GT(height.value, 0);
  EXPECT_LE(normal.value, 2e-6) << normal.where;  // twenty roundings, as in the light maps
  EXPECT_LE(height.value, 2e-6) << height.where;  // nearness is up to 3; positions of size 1, along the slope
}

TEST(Layers, EachLightHasItsOwnSumsWhereThereIsRoom) {
  DeviceInfo device;
  device.vector_width = 8;
  device.global_memory = device.max_allocation = std::uint64_t{1} << 40;
  Settings live;
  live.still = false;
  Settings still;
  still.gather = Gather::layers;
  const auto plan = [&](std::size_t lights, const Settings& settings) {
    return make_plan(scene_of(torus(32, 16), two_media, std::vector<DirectionalLight>(lights, light_a)), settings,
                     device);
  };
  EXPECT_EQ(plan(3, still).sums(), 1U);
  EXPECT_EQ(plan(9, live).sums(), 1U);
  EXPECT_EQ(plan(1, live).sums(), 1U);
  const Plan room = plan(8, live);
  EXPECT_EQ(room.sums(), 8U);
  const std::uint64_t texels = std::uint64_t{live.layers} * live.layer_size * live.layer_size;
  EXPECT_EQ(plan(8, live).bytes - plan(9, live).bytes + plan(9, still).bytes - plan(8, still).bytes, texels * 32 * 8);
  device.global_memory = (room.bytes - texels * 32 * 4) / 9 * 10;
  const Plan less = plan(8, live);
  EXPECT_EQ(less.sums(), 1U);
  EXPECT_LE(less.bytes, room.bytes - texels * 32 * 8);
  device.global_memory = less.bytes / 9 * 5;
  EXPECT_THROW((void)plan(8, live), Error);
}

TEST(Layers, TwoRunsGiveTheSameBits) {
  std::vector<float4> runs[2];
  const auto lights = fitted(std::vector{light_a, light_b}, std::vector{light_a});
  for (auto& run : runs) run = LitBench(two_media, lights, 64, true, fitted(3U, 9U), {}).frames(3);
  ASSERT_EQ(runs[0].size(), runs[1].size());
  for (std::size_t i = 0; i < runs[0].size(); ++i)
    for (int c = 0; c < 3; ++c)
      ASSERT_EQ(std::bit_cast<std::uint32_t>(static_cast<float>(exact(runs[0][i])[c])),
                std::bit_cast<std::uint32_t>(static_cast<float>(exact(runs[1][i])[c])))
          << i;
}

}  // namespace
}  // namespace parian::test
