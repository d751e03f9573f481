// Guides of samples: the curve, lists of what is lit along it, strips that give about as much light each, and room.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>

#include "kernels/sampling.h"
#include "test_lit.hpp"

namespace parian::test {
namespace {

TEST(Guides, CubesThatComeOneAfterTheOtherAreNeighbours) {
  std::vector<glm::ivec3> cubes(GUIDE_CUBES, glm::ivec3(-1));
  for (int z = 0; z < int{GUIDE_SIDE}; ++z)
    for (int y = 0; y < int{GUIDE_SIDE}; ++y)
      for (int x = 0; x < int{GUIDE_SIDE}; ++x)
        cubes.at(kernels::cube_number(std::uint32_t(x), std::uint32_t(y), std::uint32_t(z))) = {x, y, z};
  for (std::size_t i = 1; i < cubes.size(); ++i) {
    const glm::ivec3 step = glm::abs(cubes[i] - cubes[i - 1]);
    ASSERT_EQ(step.x + step.y + step.z, 1) << i;  // so that all have numbers, too
  }
}

class GuidesOf : public testing::TestWithParam<std::pair<const char*, Material>> {
 protected:
  /// Everything is needed; made once for each material.
  static const LitBench& lit_bench() {
    static auto& made = *new std::map<std::string, LitBench>;  // never destroyed: drivers may end first
    return made
        .try_emplace(GetParam().first, GetParam().second, std::vector{light_a, light_b}, 100U, false, 1U,
                     std::function<void(Plan&)>())
        .first->second;
  }
};

TEST_P(GuidesOf, ListWhatIsLitAlongACurve) {
  const LitBench& b = lit_bench();
  const LightMaps& maps = b.passes.light_maps;
  for (std::size_t map = 0; map < 4; ++map) {
    const Guide guide(b, map / 2, map % 2, 0);
    const kernels::Light& light = maps.lights[map / 2];
    const auto texel = [&](std::size_t t) { return b.map[light.map + map % 2 * maps.size * maps.size + t]; };
    for (std::size_t t = 0; t < guide.ranks().size(); ++t) {
      if (texel(t).x <= -8) {
        ASSERT_EQ(guide.ranks()[t], 0xffffffffU);
        continue;
      }
      ASSERT_LT(guide.ranks()[t], guide.list().size());
      ASSERT_EQ(guide.list()[guide.ranks()[t]], t / maps.size << 16 | t % maps.size);
    }
    std::size_t lit = 0;
    for (std::size_t t = 0; t < guide.ranks().size(); ++t) lit += texel(t).x > -8;
    ASSERT_EQ(guide.list().size(), lit);
    // Sixteen texels that come one after the other lie in a patch four wide, cut by cubes and by the object's edge.
    const std::size_t ranges = lit / 16;
    double spread = 0;
    for (std::size_t first = 0; first + 16 <= lit; first += 16) {
      glm::dvec3 sum{}, squares{};
      for (std::size_t i = first; i < first + 16; ++i) {
        const cl_uint at = guide.list()[i];
        const double z = texel((at >> 16) * maps.size + (at & 0xffff)).x * double{light.view.scale};
        const glm::dvec3 x(at & 0xffff, at >> 16, z);
        sum += x / 16.0, squares += x * x / 16.0;
      }
      const glm::dvec3 variance = squares - sum * sum;
      spread += std::sqrt(variance.x + variance.y + variance.z) / double(ranges);
    }
    fmt::print("map {}: {} texels lit, ranges of 16 spread by {:.2f} texels\n", map, lit, spread);
    EXPECT_LT(spread, 5);
  }
}

TEST_P(GuidesOf, StripsGiveAboutAsMuchLightEach) {
  const LitBench& b = lit_bench();
  const LightMaps& maps = b.passes.light_maps;
  std::vector<double> variances;
  for (std::size_t map = 0; map < 4; ++map)
    for (std::size_t tile = 0; tile < b.passes.layers.n_tiles; ++tile) {
      const kernels::Light& light = maps.lights[map / 2];
      const ExactView view(light.view);
      const float4 stand = b.stands[map / 2 * b.passes.layers.n_tiles + tile];
      const Guide guide(b, map / 2, map % 2, tile);
      ASSERT_EQ(bool(guide), stand.w > 0);
      if (!guide) continue;
      const glm::dvec3 p = view.frame(exact(stand) - view.origin);
      ASSERT_EQ(guide.begins().front(), 0U);
      ASSERT_LE(guide.begins().back(), static_cast<double>(guide.list().size()) * guide.unit());
      // What each lit texel gives of a channel's light, summed over channels that aren't alike.
      std::vector<double> gives(guide.list().size());
      for (std::size_t m = 0; m < b.plan.media.size(); ++m) {
        const kernels::Medium& medium = b.plan.media[m];
        if (!(medium.scale > 0)) continue;
        std::vector<double> of_medium;
        for (const cl_uint at : guide.list()) {
          const MapTexel texel(
              b.map[light.map + map % 2 * maps.size * maps.size + (at >> 16) * maps.size + (at & 0xffff)]);
          const glm::dvec2 film((at & 0xffff) + 0.5 - light.view.centre_x, (at >> 16) + 0.5 - light.view.centre_y);
          const double d = glm::length(glm::dvec3(film / double{light.view.scale}, texel.height) - p);
          const double T12 = kernels::fresnel_transmittance(texel.n.z, b.plan.boundary);
          of_medium.push_back(T12 * std::exp(-double{medium.sigma_tr} * medium.sigma_t_prime * d) / (d * d));
        }
        const double all = std::accumulate(of_medium.begin(), of_medium.end(), 0.0);
        for (std::size_t i = 0; i < gives.size(); ++i) gives[i] += of_medium[i] / all;
      }
      const double all = std::accumulate(gives.begin(), gives.end(), 0.0);
      // How much larger the variance of a sum over the guide's samples is than with the best density, relatively: the
      // mean of (what a texel gives / its density)^2.
      double squares = 0, total = 0;
      for (std::size_t s = 0; s < guide.strips(); ++s) {
        ASSERT_LT(guide.begins()[s], guide.begins()[s + 1]);
        const double begin = guide.begins()[s] / guide.unit(), end = guide.begins()[s + 1] / guide.unit();
        for (auto i = std::size_t(begin); double(i) < end; ++i) {
          const double share = std::min(double(i + 1), end) - std::max(double(i), begin);
          const double density = 1 / (double(guide.strips()) * (end - begin));
          squares += share * gives[i] * gives[i] / (all * all) / density;
          total += share * guide.density(i);
          ASSERT_NEAR(guide.density(i) / density, 1, 0.13) << "strip " << s << " texel " << i;
        }
      }
      ASSERT_NEAR(total, 1, 0.13);  // three bits of each density
      variances.push_back(squares - 1);
    }
  ASSERT_FALSE(variances.empty());
  std::sort(variances.begin(), variances.end());
  const double median = variances[variances.size() / 2];
  fmt::print("{}: {} guides, variance in units of the mean squared: median {:.3f}, worst {:.3f}\n", GetParam().first,
             variances.size(), median, variances.back());
  // Shares are rounded to steps of a third or a half, and dense media change within a part.
  EXPECT_LT(median, GetParam().first == std::string("dense") ? 0.3 : 0.12);
  EXPECT_LT(variances.back(), 3);  // no bright place shares a strip with a long dark one
}

INSTANTIATE_TEST_SUITE_P(Media, GuidesOf,
                         testing::Values(std::pair("two", two_media), std::pair("dense", dense),
                                         std::pair("clear", medium({3, 3, 3}, {0, 0, 0}, 1.3))),
                         [](const auto& tested) { return std::string(tested.param.first); });

TEST(Guides, AreMadeWhereThereIsRoom) {
  DeviceInfo device;
  device.vector_width = 8;
  device.global_memory = device.max_allocation = std::uint64_t{1} << 40;
  Settings settings;
  settings.gather = Gather::layers;
  const auto plan = [&](std::size_t lights) {
    Scene scene = scene_of(torus(32, 16), two_media, std::vector<DirectionalLight>(lights, light_a));
    scene.film = {64, 64};  // no window of it is smaller
    return make_plan(scene, settings, device);
  };
  const auto bytes = [&](std::uint64_t lights) {
    return guide_bytes(lights, std::uint64_t{settings.layers} * guide_tiles(glm::uvec2(settings.layer_size)),
                       std::uint64_t{settings.light_map_size} * settings.light_map_size);
  };
  std::uint64_t most = 1;
  while (bytes(most + 1) <= most_guides) ++most;
  EXPECT_GE(most, 4U);  // lights, with the default layers and light maps
  EXPECT_TRUE(plan(most).guides);
  EXPECT_FALSE(plan(most + 1).guides);
  const std::uint64_t with = plan(1).bytes;
  device.global_memory = (with - bytes(1) / 2) / 9 * 10;
  const Plan without = plan(1);
  EXPECT_FALSE(without.guides);
  EXPECT_EQ(with - without.bytes, bytes(1));
  settings.estimator = Estimator::radial;
  EXPECT_FALSE(plan(1).guides);
}

}  // namespace
}  // namespace parian::test
