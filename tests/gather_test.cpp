// Pass 4 against a look-up in double, constants, the texels that it marks, and pixels that no layer sees.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "exact_look_up.hpp"
#include "kernels/sampling.h"
#include "passes/pyramids.hpp"
#include "passes/raster.hpp"
#include "passes/visibility.hpp"
#include "test_scene.hpp"

namespace parian::test {
namespace {

using kernels::float4;
using kernels::Window;

/// Of the film, of the tiles of it, and of layers: the same shapes in half the size where kernels are interpreted.
glm::uvec2 film_size() { return fitted(glm::uvec2(72, 60), glm::uvec2(36, 30)); }
std::size_t film_pixels() { return std::size_t{film_size().x} * film_size().y; }
Window tile_window(int sample_x = 128, int sample_y = 128) {
  Window w = window_of(fitted(33, 17), fitted(20, 10), sample_x, sample_y);
  w.x = fitted(20, 10), w.y = fitted(25, 12);
  return w;
}
std::uint32_t layer_side(std::uint32_t side) { return fitted(side, side / 2 + 1); }
const Camera test_camera{{1.0, 2.2, 4.0}, {0, 0, 0}, {0, 1, 0}, 32};
const DirectionalLight test_light{{0.5, 0.6, -0.6}, {3, 2, 1}};

/// A torus with light maps, layers and a film.
struct FilmBench : Bench {
  FilmBench(const std::vector<glm::dvec3>& directions, std::uint32_t layer_size)
      : Bench(scene_of(torus(36, 18), medium({2.0, 2.0, 1.6}, {0.02, 0.02, 0.05}, 1.3), {test_light})),
        view(pinhole_view(test_camera, plan.space, film_size())) {
    make_light_maps(passes, points, map_size);
    draw_light_maps(passes, 0, false);
    for (const glm::dvec3& d : directions) views.push_back(orthographic_view(points, d, layer_side(layer_size)));
    make_layers(passes, views, true);
    const std::size_t pixels = film_pixels();
    Film& f = passes.film;
    for (cl::Buffer* words : {&f.depth, &f.ids, &f.direct})
      *words = compute.buffer<cl_uint>(pixels * POSITIONS_SIDE_BY_SIDE);
    f.n_direct = compute.buffer<cl_uint>(POSITIONS_SIDE_BY_SIDE + 1);
    f.sums = compute.buffer<float4>(6 * pixels);
    f.edges = compute.buffer<cl_uint>(pixels), f.open = compute.buffer<cl_uint>(pixels);
    f.points = compute.buffer<float4>(2 * pixels), f.values = compute.buffer<float4>(2 * pixels);
    f.centres = compute.buffer<float4>(pixels), f.n_held = compute.buffer<cl_uint>(1);
  }
  /// Needs every covered texel that `wanted` takes, with values that depend on the texel alone.
  void need(const std::function<bool(cl_uint)>& wanted, const std::function<float(cl_uint)>& value) {
    const std::vector<cl_uint> slots = compute.read<cl_uint>(passes.layers.slots, passes.layers.level_first[1]);
    std::vector<cl_uint> needed;
    std::vector<float4> values;
    for (cl_uint t = 0; t < slots.size(); ++t)
      if (slots[t] == 0 && wanted(t)) {
        needed.push_back(t);
        const float v = value(t);
        values.push_back({v, 0.5F * v, 0.25F * v, 0});
        values.push_back({2 * v, v, 0.75F * v, 0});
      }
    set_needed(passes, needed);
    compute.write(passes.layers.values, values);
    build_pyramids(passes, passes.layers.levels - 1);
  }
  std::vector<float4> shoot(const Window& w, const std::vector<cl_uint>& levels, float scale, std::uint32_t rounds = 1,
                            std::uint32_t round = 0) {
    const std::size_t texels = 2 * levels.size() * w.width * w.height;
    compute.fill(passes.film.sums, 0, 4 * texels);
    draw_film(passes, view, w, true, Stage::gather);
    gather(passes, view, w, {0, passes.layers.count()}, levels, scale, round, rounds, Stage::gather);
    ids = compute.read<cl_uint>(passes.film.ids, std::size_t{w.width} * w.height);
    direct = compute.read<cl_uint>(passes.film.direct, compute.read<cl_uint>(passes.film.n_direct, 1)[0]);
    return compute.read<float4>(passes.film.sums, texels);
  }
  /// What the pixel with index `i` of a window sees.
  [[nodiscard]] Hit hit(const Window& w, std::size_t i) const {
    const std::size_t column = w.x + i % w.width, row = w.y + i / w.width;
    return hit_triangle(*this, ids[i], ExactView(view), double(column) + w.sample_x / 256.0,
                        double(row) + w.sample_y / 256.0);
  }
  [[nodiscard]] double outgoing_cosine(const Hit& h) const {
    const glm::dvec3 o = glm::normalize(exact(view.origin) - h.x);
    const auto n = kernels::bend_normal({h.n_s.x, h.n_s.y, h.n_s.z}, {o.x, o.y, o.z});
    return n.x * o.x + n.y * o.y + n.z * o.z;
  }
  [[nodiscard]] double T21(const Hit& h) const {
    return kernels::fresnel_transmittance(outgoing_cosine(h), plan.boundary);
  }

  const std::uint32_t map_size = fitted(48U, 24U);
  kernels::View view;
  std::vector<kernels::View> views;
  std::vector<cl_uint> ids, direct;
};

float value_of(cl_uint texel) { return static_cast<float>(kernels::hash(texel) >> 8) * 0x1p-23F; }

/// How many points took which way.
struct Ways {
  std::size_t oblique = 0, finer = 0, unseen = 0;
};

/// How far films were from the look-up.
struct FilmCheck {
  Worst worst;
  std::size_t compared = 0, skipped = 0;
  Ways ways;

  /// Of so many points in all.
  void judge(std::size_t points, const std::string& what) const {
    fmt::print(
        "{}: {} compared, {} skipped, {} oblique, {} by a finer level, {} unseen; worst {:.2f} of tolerance ({})\n",
        what, compared, skipped, ways.oblique, ways.finer, ways.unseen, worst.value, worst.where);
    EXPECT_GT(compared, points / 8);
    EXPECT_LT(skipped, (compared + ways.unseen) / 8);
    EXPECT_LE(worst.value, 1) << worst.where;
  }
};

/// Compares a window's film with the look-up, and adds to `sum` which ways its points took.
void check_film(FilmBench& b, const Window& w, const std::vector<cl_uint>& levels, const std::string& what,
                Ways* sum = nullptr) {
  const float scale = 0.125F;
  const std::vector<float4> sums = b.shoot(w, levels, scale, 16);  // a single round may miss all that is lit
  const Stored stored(b);
  const std::set<cl_uint> direct(b.direct.begin(), b.direct.end());
  EXPECT_EQ(direct.size(), b.direct.size()) << "pixels that are listed twice";
  const std::size_t pixels = b.ids.size();
  FilmCheck check;
  auto& [worst, compared, skipped, ways] = check;
  for (std::size_t i = 0; i < pixels; ++i) {
    const float covered = b.ids[i] == no_slot ? 0.0F : 1.0F;
    for (std::size_t set = 0; set < levels.size(); ++set) ASSERT_EQ(sums[2 * (set * pixels + i)].w, covered) << i;
    if (b.ids[i] == no_slot) {
      ASSERT_EQ(glm::length(exact(sums[2 * i])), 0) << i;
      continue;
    }
    const Hit h = b.hit(w, i);
    if (h.inside() < 1e-3 || h.cosine < 1e-2) {  // the device moves it onto the triangle
      ++skipped;
      continue;
    }
    const double cosine = b.outgoing_cosine(h), factor = scale * b.T21(h);
    const Lookup finest = look_up(stored, 0, h.x, h.n_g);
    if (finest.doubtful) {
      skipped += levels.size();
      continue;
    }
    EXPECT_EQ(direct.contains(cl_uint(i)), finest.weight < 1e-3) << what << " pixel " << i;
    if (finest.weight < 1e-3) {  // every set gets the same from gather_direct
      ways.unseen += levels.size();
      for (std::size_t value = 0; value < 2 * levels.size(); ++value) {
        const glm::dvec3 v = exact(sums[2 * (value / 2 * pixels + i) + value % 2]);
        EXPECT_TRUE(v == exact(sums[2 * i + value % 2]) && glm::length(v) > 0) << what << " pixel " << i;
      }
      continue;
    }
    for (std::size_t set = 0; set < levels.size(); ++set) {
      cl_uint level = levels[set];
      Lookup l = look_up(stored, level, h.x, h.n_g);
      while (!l.doubtful && l.weight < 1e-3 && level > 0) l = look_up(stored, --level, h.x, h.n_g), ++ways.finer;
      if (l.doubtful) {
        ++skipped;
        continue;
      }
      ways.oblique += l.oblique;
      const float4 a = sums[2 * (set * pixels + i)], v = sums[2 * (set * pixels + i) + 1];
      const double error =
          largest({glm::length(exact(a) - factor * l.a / l.weight), glm::length(exact(v) - factor * l.b / l.weight)});
      // Values are below 6. T21 falls with the cosine, which the shading normal has to 1e-6.
      const double tolerance = factor * 6 * (1e-6 + l.weight_error / l.weight + 1e-6 / cosine);
      ++compared;
      worst.add(error / tolerance,
                [&] { return fmt::format("{} level {} pixel {} {}", what, levels[set], i, hex(h.x)); });
    }
  }
  check.judge(pixels * levels.size(), what);
  if (sum) sum->oblique += ways.oblique, sum->finer += ways.finer, sum->unseen += ways.unseen;
}

// A shift of d pixels errs by d times the relative gradient, which is up to 1 per pixel at lit rims.
TEST(Gather, PositionsAreCentredInThePixel) {
  for (const std::uint32_t count : {2U, 8U, 64U}) {
    glm::ivec2 sum(0);
    for (std::uint32_t i = 0; i < count; ++i) sum += subpixel_position(i, 0);
    EXPECT_EQ(sum, glm::ivec2(128 * static_cast<int>(count))) << count;
  }
}

TEST(Gather, AgreesWithALookUpInDouble) {
  for (const bool holes : {false, true}) {
    FilmBench b(even_directions(fitted(7, 4)), 41);
    b.need([&](cl_uint t) { return !holes || kernels::hash(t ^ 77U) % 3 > 0; }, value_of);
    const std::string what = holes ? "a third missing" : "all texels";
    check_film(b, window_of(film_size().x, film_size().y, 128, 128), {0}, what);
    check_film(b, window_of(film_size().x, film_size().y, 3, 250), {3, 1, 0}, what);
    check_film(b, tile_window(200, 60), {2, 0}, what + ", tile");
  }
}

TEST(Gather, AgreesWithALookUpWhereFewLayersSee) {
  FilmBench b({{0.9, 0.3, 0.5}, {-0.2, 1.0, 0.3}}, 53);
  b.need([&](cl_uint t) { return kernels::hash(t ^ 77U) % 16 < 5; }, value_of);
  Ways sum;
  for (const glm::ivec2 s : {glm::ivec2(128, 128), glm::ivec2(77, 9)})
    check_film(b, window_of(film_size().x, film_size().y, s.x, s.y), {5, 4, 0}, "two layers", &sum);
  EXPECT_GT(sum.oblique, film_pixels() / 21);
  EXPECT_GT(sum.finer, film_pixels() / 43);
  EXPECT_GT(sum.unseen, film_pixels() / 21);
}

TEST(Gather, ConstantLayersGiveAConstantTimesT21) {
  FilmBench b(even_directions(fitted(7, 4)), 41);
  b.need([](cl_uint) { return true; }, [](cl_uint) { return 0.8F; });
  const Window w = window_of(film_size().x, film_size().y);
  const std::vector<cl_uint> levels{4, 2, 0};
  const std::vector<float4> sums = b.shoot(w, levels, 0.5F);
  const std::set<cl_uint> direct(b.direct.begin(), b.direct.end());
  Worst worst;
  for (std::size_t set = 0; set < 3; ++set)
    for (std::size_t i = 0; i < b.ids.size(); ++i) {
      if (b.ids[i] == no_slot || direct.contains(cl_uint(i))) continue;
      const Hit h = b.hit(w, i);
      if (h.inside() < 1e-3 || h.cosine < 1e-2) continue;
      const float4 a = sums[2 * (set * b.ids.size() + i)], v = sums[2 * (set * b.ids.size() + i) + 1];
      const double expected = 0.5 * b.T21(h) * 0.8;
      const double error = largest({glm::length(exact(a) / expected - glm::dvec3(1, 0.5, 0.25)),
                                    glm::length(exact(v) / expected - glm::dvec3(2, 1, 0.75))});
      worst.add(error / (2e-6 * (1 + 1 / b.outgoing_cosine(h)) * (1 + 1 / h.cosine)),
                [&] { return fmt::format("level {} pixel {}", levels[set], i); });
    }
  fmt::print("constant: worst {:.2f} of tolerance ({})\n", worst.value, worst.where);
  EXPECT_LE(worst.value, 1) << worst.where;  // means of equal values; T21's cosine, from a place on an edge-on triangle
}

// Sums of up to eight values below 6, which may be added in another order: some units of 2^-24 of their sum.
TEST(Gather, PositionsSideBySideAddUpToTheSameAsOneByOne) {
  FilmBench b({{0.9, 0.3, 0.5}, {-0.2, 1.0, 0.3}}, 53);
  b.need([&](cl_uint t) { return kernels::hash(t ^ 77U) % 16 < 12; }, value_of);
  const std::vector<cl_uint> levels{2, 1, 0};
  Worst worst;
  std::size_t direct = 0;
  for (Window w : {window_of(film_size().x, film_size().y), tile_window()})
    for (std::uint32_t positions = 2; positions <= 8; positions *= fitted(2U, 4U)) {
      ASSERT_EQ(set_positions(w, 8, positions), positions);
      const std::vector<float4> found = b.shoot(w, levels, 0.125F, 2);
      std::vector<glm::dvec4> expected(found.size(), glm::dvec4(0));
      for (std::uint32_t k = 0; k < positions; ++k) {
        Window one = w;
        set_positions(one, 8 + k, 1);
        const std::vector<float4> sums = b.shoot(one, levels, 0.125F, 2, 2 * k);
        direct += b.direct.size();
        for (std::size_t i = 0; i < sums.size(); ++i) expected[i] += glm::dvec4(exact(sums[i]), sums[i].w);
      }
      for (std::size_t i = 0; i < found.size(); ++i) {
        ASSERT_TRUE(i % 2 == 1 || double{found[i].w} == expected[i].w) << i;
        const double error = glm::length(exact(found[i]) - glm::dvec3(expected[i]));
        worst.add(error / (16 * 0x1p-24 * std::max(glm::length(glm::dvec3(expected[i])), 1e-3)),
                  [&] { return fmt::format("{} positions, {}", positions, i); });
      }
    }
  fmt::print("side by side: {} points that no layer sees, worst {:.2f} of tolerance ({})\n", direct, worst.value,
             worst.where);
  EXPECT_LE(worst.value, 1) << worst.where;
  EXPECT_GT(direct, film_pixels() / 43);
}

TEST(Gather, MarksCoverAllThatIsRead) {
  FilmBench b(even_directions(fitted(7, 4)), 41);
  Window w = window_of(film_size().x, film_size().y);
  const cl_uint texels = b.passes.layers.level_first[1];
  const cl::Buffer marks = b.compute.buffer<cl_uint>(texels);
  b.compute.fill(marks, 0, texels);
  setup_view(b.passes, b.view, Stage::plan);
  const std::vector<glm::ivec2> positions{{128, 128}, {10, 240}, {200, 33}};
  for (const glm::ivec2 s : positions) {
    w.sample_x = s.x, w.sample_y = s.y;
    mark_needed(b.passes, b.view, w, marks);
  }
  const std::vector<cl_uint> marked = b.compute.read<cl_uint>(marks, texels);
  std::vector<std::vector<float4>> films[2];
  for (const bool all : {false, true}) {
    make_layers(b.passes, b.views, true);
    b.need([&](cl_uint t) { return all || marked[t] != 0; }, value_of);
    if (!all) {
      EXPECT_LT(b.passes.layers.n_points, texels / 3);
    }
    for (const glm::ivec2 s : positions) {
      w.sample_x = s.x, w.sample_y = s.y;
      films[all].push_back(b.shoot(w, {0}, 1.0F));
    }
  }
  for (std::size_t s = 0; s < positions.size(); ++s)
    for (std::size_t i = 0; i < films[0][s].size(); ++i)
      for (int c = 0; c < 3; ++c) ASSERT_EQ(exact(films[0][s][i])[c], exact(films[1][s][i])[c]) << s << " " << i;
}

TEST(Gather, PixelsThatNoLayerSeesAreComputedDirectly) {
  FilmBench b({{0.3, -0.4, -1.0}}, 33);  // a layer that looks from behind
  b.need([](cl_uint) { return true; }, [](cl_uint) { return 0.0F; });
  const Window w = window_of(film_size().x, film_size().y);
  constexpr int seeds = 32, rounds = 48;
  std::vector<glm::dvec3> sum, squares;
  std::size_t zeros = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    b.passes.seed = 500 + seed;
    const std::vector<float4> sums = b.shoot(w, {1, 0}, 1.0F, rounds);
    std::sort(b.direct.begin(), b.direct.end());
    sum.resize(b.direct.size()), squares.resize(b.direct.size());
    for (std::size_t k = 0; k < b.direct.size(); ++k) {
      const glm::dvec3 v = exact(sums[2 * b.direct[k]]), v0 = exact(sums[2 * (b.ids.size() + b.direct[k])]);
      ASSERT_EQ(v, v0);  // both levels get the same
      for (int c = 0; c < 3; ++c) zeros += !(v[c] > 0) + !(exact(sums[2 * b.direct[k] + 1])[c] > 0);
      sum[k] += v, squares[k] += v * v;
    }
  }
  ASSERT_GT(b.direct.size(), 300U);
  EXPECT_EQ(zeros, 0U);
  const kernels::Light& light = b.passes.light_maps.lights[0];
  const std::vector<float4> map =
      b.compute.read<float4>(b.passes.light_maps.map, std::size_t{2} * b.map_size * b.map_size);
  Worst worst;
  double z2 = 0, precision = 0;
  int count = 0;
  for (std::size_t k = 0; k < b.direct.size(); k += b.direct.size() / 24) {
    const Hit h = b.hit(w, b.direct[k]);
    if (h.inside() < 1e-3 || h.cosine < 1e-2) continue;
    const glm::dvec3 truth = b.T21(h) * quadrature(b.plan, light, map, h.x, h.n_s);
    for (int c = 0; c < 3; ++c) {
      const double mean = sum[k][c] / seeds,
                   variance = std::max(squares[k][c] / seeds - mean * mean, 0.0) / (seeds - 1);
      const double error = std::sqrt(variance + std::pow(5e-4 * truth[c], 2));  // of quadrature, as in pass 2's test
      const double z = std::fabs(mean - truth[c]) / error;
      z2 += z * z, precision += std::sqrt(variance) / truth[c], ++count;
      worst.add(z, [&] {
        return fmt::format("pixel {} channel {}: {:.6g}, expected {:.6g}", b.direct[k], c, mean, truth[c]);
      });
    }
  }
  fmt::print("direct: {} pixels, standard error {:.2g}, mean square of deviations {:.2f}, worst {:.2f} ({})\n",
             b.direct.size(), precision / count, z2 / count, worst.value, worst.where);
  EXPECT_LE(worst.value, 4.0) << worst.where;
  EXPECT_LE(z2 / count, 2.0);
  EXPECT_LE(precision / count, 0.01);
}

}  // namespace
}  // namespace parian::test
