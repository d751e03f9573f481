// The rasteriser against brute force in exact integers, from the set-up that it stored; the set-up against double.
#include <gtest/gtest.h>

#include <algorithm>

#include "exact_raster.hpp"
#include "passes/raster.hpp"
#include "test_scene.hpp"

namespace parian::test {
namespace {

using kernels::View;

Visible device_draw(Bench& b, const Window& w) {
  const std::size_t n = std::size_t{w.width} * w.height;
  const cl::Buffer depth = b.compute.buffer<cl_uint>(n), ids = b.compute.buffer<cl_uint>(n);
  draw(b.passes, w, depth, &ids, Stage::layers);
  return {b.compute.read<cl_uint>(depth, n), b.compute.read<cl_uint>(ids, n)};
}

std::vector<RasterTriangle> setup(Bench& b, const View& view) {
  setup_view(b.passes, view, Stage::layers);
  return b.compute.read<RasterTriangle>(b.passes.geometry.records, b.passes.geometry.n_records);
}

/// Draws a window and compares every depth and id; returns how many samples are covered.
std::size_t check_draw(Bench& b, const std::vector<RasterTriangle>& records, const Window& w, const std::string& what) {
  const Visible found = device_draw(b, w), expected = reference(records, w);
  std::size_t covered = 0, wrong = 0;
  for (std::size_t i = 0; i < expected.ids.size(); ++i) {
    covered += expected.ids[i] != 0xffffffffU;
    if (found.depth[i] == expected.depth[i] && found.ids[i] == expected.ids[i]) continue;
    if (++wrong > 3) continue;
    ADD_FAILURE() << fmt::format("{}: pixel ({}, {}) sample ({}, {}): depth {:#x} id {}, expected {:#x} id {}", what,
                                 w.x + i % w.width, w.y + i / w.width, w.sample_x, w.sample_y, found.depth[i],
                                 found.ids[i], expected.depth[i], expected.ids[i]);
  }
  EXPECT_EQ(wrong, 0U) << what;
  return covered;
}

/// Whatever plan; positions go to the device as they are, so that film coordinates can be chosen to the bit.
Bench plain(const Mesh& mesh, bool clipping = false) {
  Settings settings;
  if (clipping) settings.keep = {"clipping"};
  return Bench(scene_of(mesh), settings, [](Plan& p) { p.space = {glm::dvec3(0), 1.0}; });
}

/// The same, with so many lanes.
Bench with_lanes(const Mesh& mesh, std::uint32_t lanes) {
  return Bench(scene_of(mesh), {}, [&](Plan& p) {
    p.space = {glm::dvec3(0), 1.0};
    p.lanes = lanes;
    set_option(p.options, "VW", static_cast<int>(lanes));
  });
}

/// Film pixels are units of x and y (y down), nearness is z + 2.
View flat_view(std::uint32_t width, std::uint32_t height) {
  View v{};
  v.right = {1, 0, 0, 0}, v.down = {0, 1, 0, 0}, v.back = {0, 0, 1, 0};
  v.scale = 1;
  v.width = width, v.height = height;
  return v;
}

/// Triangles of one kind strewn over a film and beyond its borders.
Mesh soup(std::uint32_t seed, int count, glm::dvec2 film, const std::function<glm::dvec2(Random&)>& edge) {
  Mesh mesh;
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    const glm::dvec3 at(random(-0.2, 1.2) * film.x, random(-0.2, 1.2) * film.y, random(-0.9, 0.9));
    glm::dvec3 p[3] = {at, at, at};
    for (int c = 1; c < 3; ++c) p[c] += glm::dvec3(edge(random), random(-0.1, 0.1));
    add_triangle(mesh, p[0], p[1], p[2]);
  }
  return mesh;
}

/// What one rounding changes in the nearness plane at (dx, dy) from corner 0: of the corners' values, together
/// `noise`, and of the products that make up the slopes.
double rounding_unit(const RasterTriangle& t, double noise, double dx, double dy) {
  const double dx1 = t.x1 - t.x0, dy1 = t.y1 - t.y0, dx2 = t.x2 - t.x0, dy2 = t.y2 - t.y0;
  const double dq1 = t.q_x * dx1 + t.q_y * dy1, dq2 = t.q_x * dx2 + t.q_y * dy2;
  const double across =
      std::fabs(dx) * (std::fabs(dy1) + std::fabs(dy2)) + std::fabs(dy) * (std::fabs(dx1) + std::fabs(dx2));
  const double products = std::fabs(dx) * (std::fabs(dq1 * dy2) + std::fabs(dq2 * dy1)) +
                          std::fabs(dy) * (std::fabs(dq2 * dx1) + std::fabs(dq1 * dx2));
  return 0x1p-24 * (noise * (1 + across / (dx1 * dy2 - dx2 * dy1)) + products / (dx1 * dy2 - dx2 * dy1));
}

/// Distance of stored corners from a double projection, and of the nearness plane from the corners' own nearness in
/// units of the rounding errors that the float32 plane can have.
void check_setup(const Bench& b, const View& view, const std::vector<RasterTriangle>& records,
                 const std::string& what) {
  const ExactView exact_view(view);
  Worst snap, plane;
  for (const RasterTriangle& t : records) {
    if (t.triangle == 0xffffffffU) continue;
    glm::dvec3 p[3];
    for (int c = 0; c < 3; ++c) p[c] = exact_view.film(b.corner(t.triangle, c));
    // The stored order may be turned: corner 1 is the mesh's second or third.
    const auto off = [&](int c, int x, int y) { return std::hypot(p[c].x * 256 - x, p[c].y * 256 - y); };
    const bool turned = off(1, t.x1, t.y1) + off(2, t.x2, t.y2) > off(2, t.x1, t.y1) + off(1, t.x2, t.y2);
    if (turned) std::swap(p[1], p[2]);
    const int x[3] = {t.x0, t.x1, t.x2}, y[3] = {t.y0, t.y1, t.y2};
    // Of the view coordinates too, which are at most 3.
    const double noise = std::fabs(p[0].z) + std::fabs(p[1].z) + std::fabs(p[2].z);
    for (int c = 0; c < 3; ++c) {
      const auto where = [&] { return fmt::format("triangle {} {}", t.triangle, hex(p[c])); };
      snap.add(largest({std::fabs(p[c].x * 256 - x[c]), std::fabs(p[c].y * 256 - y[c])}), where);
      const double dx = x[c] - x[0], dy = y[c] - y[0];
      const double q = double{t.q0} + double{t.q_x} * dx + double{t.q_y} * dy;
      plane.add(std::fabs(q - p[c].z) / rounding_unit(t, noise, dx, dy), where);
    }
  }
  fmt::print("{}: set-up within {:.3f} subpixels ({}); nearness within {:.2f} rounding units ({})\n", what, snap.value,
             snap.where, plane.value, plane.where);
  EXPECT_LE(snap.value, 1.0) << what << snap.where;    // half for rounding to nearest, the rest for float32 coordinates
  EXPECT_LE(plane.value, 2.0) << what << plane.where;  // each of the eight operations rounds by half an ulp
}

TEST(Raster, RandomTrianglesAreExact) {
  struct Kind {
    const char* name;
    int count;
    std::function<glm::dvec2(Random&)> edge;
  };
  const Kind kinds[] = {
      {"tiny", 4000, [](Random& r) { return glm::dvec2(r(-1.5, 1.5), r(-1.5, 1.5)); }},
      {"medium", 600, [](Random& r) { return glm::dvec2(r(-12, 12), r(-12, 12)); }},
      {"large", 60, [](Random& r) { return glm::dvec2(r(-90, 90), r(-90, 90)); }},
      {"needles", 300,
       [](Random& r) {
         const double a = r(-60, 60);
         return glm::dvec2(a, 0.7 * a + r(-0.02, 0.02));
       }},
  };
  const glm::uvec2 films[] = {{101, 67}, {7, 3}, {1, 1}, {4096, 5}};
  std::size_t covered = 0, samples = 0;
  for (std::uint32_t k = 0; k < std::size(kinds); ++k)
    for (const glm::uvec2 film : films) {
      const int count = kinds[k].count / fitted(1, k == 2 ? 1 : k == 1 ? 3 : 6);
      Bench b = plain(soup(7 + k, film.x == 4096 ? count / 2 : count, film, kinds[k].edge));
      const View view = flat_view(film.x, film.y);
      const std::vector<RasterTriangle> records = setup(b, view);
      const std::string what = fmt::format("{} on {}x{}", kinds[k].name, film.x, film.y);
      if (film.x == 101) check_setup(b, view, records, what);
      for (const glm::ivec2 s : {glm::ivec2(128), glm::ivec2(0), glm::ivec2(255, 3)}) {
        covered += check_draw(b, records, window_of(film.x, film.y, s.x, s.y), what);
        samples += std::size_t{film.x} * film.y;
      }
      if (film.x > 40 && film.y > 40) {
        Window tile = window_of(33, 21, 17, 201);
        tile.x = film.x - 40, tile.y = 9;
        check_draw(b, records, tile, what + " tile");
      }
    }
  fmt::print("{} of {} samples covered\n", covered, samples);
  EXPECT_GT(covered, samples / 10);
}

// One by one they are compared with exact integers above.
TEST(Raster, PositionsSideBySideAreTheSameAsOneByOne) {
  const std::pair<int, double> kinds[] = {{fitted(3000, 600), 1.5}, {fitted(300, 60), 12}, {fitted(40, 15), 90}};
  const glm::uvec2 film(fitted(61, 29), fitted(47, 21));
  std::size_t covered = 0, samples = 0;
  for (std::uint32_t lanes = 1; lanes <= 16; lanes *= lanes == 1 ? 4 : fitted(2U, 4U))
    for (const auto& [count, reach] : kinds) {
      const double side = reach;
      Bench b = with_lanes(soup(3, count, film, [&](Random& r) { return glm::dvec2(r(-side, side), r(-side, side)); }),
                           lanes);
      setup(b, flat_view(film.x, film.y));
      for (std::uint32_t positions = 2; positions <= 8; positions *= fitted(2U, 4U)) {
        Window w = window_of(fitted(33, 13), fitted(21, 9));
        w.x = fitted(20, 9), w.y = fitted(9, 7);
        const std::size_t n = std::size_t{w.width} * w.height;
        const cl::Buffer depth = b.compute.buffer<cl_uint>(n * positions),
                         ids = b.compute.buffer<cl_uint>(n * positions);
        std::vector<cl_uint> open(n);
        Random random(positions);
        for (cl_uint& o : open) o = random(0, 1) < 0.3 ? 1 : 0;
        b.passes.film.open = b.compute.upload(open);
        b.passes.film.drawn.reset();
        // All pixels; then those that are open, twice, so that what the first left behind would show.
        for (const std::uint32_t start : {0U, 8U, 16U}) {
          ASSERT_EQ(set_positions(w, start, positions), positions);
          w.restricted = start > 0;
          draw(b.passes, w, depth, &ids, Stage::layers);
          b.passes.film.drawn = flat_view(film.x, film.y), b.passes.film.window = w;
          if (start == 0) b.passes.film.drawn.reset();
          const std::vector<cl_uint> found = b.compute.read<cl_uint>(ids, n * positions);
          const std::vector<cl_uint> found_depth = b.compute.read<cl_uint>(depth, n * positions);
          for (std::uint32_t k = 0; k < positions; ++k) {
            const glm::ivec2 s = subpixel_position(start + k, 0);
            Window one = window_of(w.width, w.height, s.x, s.y);
            one.x = w.x, one.y = w.y;
            const Visible expected = device_draw(b, one);
            std::size_t wrong = 0;
            for (std::size_t i = 0; i < n; ++i) {
              const bool drawn = start == 0 || open[i];
              wrong += found[i * positions + k] != (drawn ? expected.ids[i] : 0xffffffffU) ||
                       found_depth[i * positions + k] != (drawn ? expected.depth[i] : 0xffffffffU);
              covered += drawn && expected.ids[i] != 0xffffffffU, ++samples;
            }
            EXPECT_EQ(wrong, 0U) << fmt::format("{} lanes, triangles of {} pixels, position {} from {} of {}", lanes,
                                                side, k, start, positions);
          }
        }
      }
    }
  fmt::print("{} of {} samples covered\n", covered, samples);
  EXPECT_GT(covered, 3 * samples / 10);
}

TEST(Raster, ClosedMeshesThroughFittedAndPinholeViewsAreExact) {
  Bench b(scene_of(torus(48, 24)));
  for (const std::uint32_t size : {64U, 33U}) {
    const View view = orthographic_view(b.points, {0.3, 0.9, 0.4}, size);
    const std::vector<RasterTriangle> records = setup(b, view);
    check_setup(b, view, records, fmt::format("torus, orthographic {}", size));
    EXPECT_GT(check_draw(b, records, window_of(size, size, 30, 250), "torus"), size * size / 8);
  }
  const Camera camera{{0.5, 2.0, 3.0}, {0.0, 0.0, 0.0}, {0, 1, 0}, 35};
  const View view = pinhole_view(camera, b.plan.space, {90, 70});
  const std::vector<RasterTriangle> records = setup(b, view);
  check_setup(b, view, records, "torus, pinhole");
  EXPECT_GT(check_draw(b, records, window_of(90, 70), "torus, pinhole"), 1000U);
}

TEST(Raster, LowestIdWinsAmongCoplanarDuplicates) {
  Mesh mesh;
  for (int i = 0; i < 40; ++i) {
    const double s = i % 2 ? 30 : 9;  // one large and one small triangle, in turn
    add_triangle(mesh, {2.3, 1.2, 0.1}, {2.3 + s, 2.2, 0.3}, {4.4, 1.7 + s, -0.2});
  }
  Bench b = plain(mesh);
  const std::vector<RasterTriangle> records = setup(b, flat_view(40, 40));
  check_draw(b, records, window_of(40, 40), "duplicates");
  const Visible v = device_draw(b, window_of(40, 40));
  for (const cl_uint id : v.ids) EXPECT_TRUE(id == 0xffffffffU || id < 2U) << id;
}

TEST(Raster, TriangleHundredTimesTheFilm) {
  Mesh mesh;
  add_triangle(mesh, {-6400.3, -6350.7, -0.9}, {6410.1, -100.2, 0.9}, {-300.9, 6399.6, 0.4});
  Bench b = plain(mesh);
  const View view = flat_view(64, 64);
  const std::vector<RasterTriangle> records = setup(b, view);
  check_setup(b, view, records, "huge");
  EXPECT_EQ(check_draw(b, records, window_of(64, 64), "huge"), 64U * 64U);
}

/// Draws the records of each triangle alone and counts how often each sample is covered.
std::vector<int> coverage_counts(Bench& b, const std::vector<RasterTriangle>& records, const Window& w) {
  Geometry& g = b.passes.geometry;
  const cl_uint all = g.n_records, slots = b.plan.records;
  const std::size_t n = std::size_t{w.width} * w.height;
  const cl::Buffer depth = b.compute.buffer<cl_uint>(n);
  std::vector<int> counts(n, 0);
  g.n_records = slots;
  for (std::size_t first = 0; first < records.size(); first += slots) {
    const auto at = records.begin() + std::ptrdiff_t(first);
    if (std::all_of(at, at + slots, [](const RasterTriangle& t) { return t.triangle == 0xffffffffU; })) continue;
    b.compute.write(g.records, std::vector<RasterTriangle>(at, at + slots));
    draw(b.passes, w, depth, nullptr, Stage::layers);
    const std::vector<cl_uint> drawn = b.compute.read<cl_uint>(depth, n);
    for (std::size_t i = 0; i < n; ++i) counts[i] += drawn[i] != 0xffffffffU;
  }
  g.n_records = all;
  b.compute.write(g.records, records);
  return counts;
}

void expect_once(const std::vector<int>& counts, const Window& w, const std::string& what) {
  std::size_t holes = 0, doubles = 0, first = counts.size();
  for (std::size_t i = 0; i < counts.size(); ++i) {
    holes += counts[i] == 0, doubles += counts[i] > 1;
    if (counts[i] != 1) first = std::min(first, i);
  }
  EXPECT_EQ(holes + doubles, 0U) << fmt::format("{}: {} holes, {} doubles, the first at ({}, {})", what, holes, doubles,
                                                first % w.width, first / w.width);
}

TEST(Raster, SharedEdgesCoverEachSampleOnce) {
  // A grid over more than the film, half of its corners exactly on pixel centres, the rest jittered; diagonals both
  // ways.
  Mesh grid;
  Random random(11);
  constexpr int n = 9;
  glm::dvec3 p[n + 1][n + 1];
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) {
      const bool border = i == 0 || j == 0 || i == n || j == n;
      p[i][j] = glm::dvec3(4 * i - 2, 4 * j - 2, random(-0.9, 0.9));
      if (!border && random(0, 1) < 0.5)
        p[i][j] += glm::dvec3(0.5, 0.5, 0);
      else if (!border)
        p[i][j] += glm::dvec3(random(-1.2, 1.2), random(-1.2, 1.2), 0);
    }
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const int k = (i + j) % 2;  // which diagonal
      add_triangle(grid, p[i][j], p[i + 1][j], k ? p[i][j + 1] : p[i + 1][j + 1]);
      add_triangle(grid, k ? p[i + 1][j] : p[i][j], p[i][j + 1], p[i + 1][j + 1]);
    }
  // A fan around a pixel's centre, its rim far outside.
  Mesh fan;
  for (int i = 0; i < 24; ++i) {
    const auto rim = [](int k) {
      const double a = 2 * std::numbers::pi * (k % 24) / 24;
      return glm::dvec3(16.5 + 60 * std::cos(a), 16.5 + 60 * std::sin(a), 0);
    };
    add_triangle(fan, {16.5, 16.5, 0.5}, rim(i), rim(i + 1));
  }
  for (const bool regular : {true, false}) {
    Bench b = plain(regular ? grid : fan);
    const std::vector<RasterTriangle> records = setup(b, flat_view(32, 32));
    for (const glm::ivec2 s : {glm::ivec2(128), glm::ivec2(0), glm::ivec2(77, 128)}) {
      if (s.x != 128 && fitted(false, true)) continue;
      const Window w = window_of(32, 32, s.x, s.y);
      expect_once(coverage_counts(b, records, w), w, regular ? "grid" : "fan");
    }
  }
}

TEST(Raster, ClippedSurfacesAreWatertight) {
  // Inside a convex closed surface every sample sees exactly one triangle, whatever near plane and guard band cut.
  for (const bool cube : {true, false}) {
    Bench b = plain(cube ? box(fitted(3, 2), 5) : icosphere(fitted(2, 1)), true);
    ASSERT_EQ(b.plan.records, 6U);
    Random random(3);
    std::size_t cut = 0;
    Worst worst, relative;
    for (int i = 0; i < 8; i += i < 2 ? 1 : fitted(1, 3)) {
      // Some eyes nearly on a face, so that the near plane cuts it inside the film.
      const glm::dvec3 eye = i < 2   ? glm::dvec3(0.1, cube ? 0.9993 : 0.93, 0.05)
                             : i < 4 ? glm::dvec3(0)
                                     : 0.6 * random.direction();
      View view = pinhole_view({eye, eye + random.direction(), random.direction(), i % 2 ? 120.0 : 40.0}, b.plan.space,
                               {41, 37});
      if (i == 1) view.near_distance = 0.02F;
      const std::vector<RasterTriangle> records = setup(b, view);
      for (std::size_t r = 0; r < records.size(); ++r) cut += r % 6 > 0 && records[r].triangle != 0xffffffffU;
      const std::string what = fmt::format("{} from {}", cube ? "box" : "sphere", hex(eye));
      const Window w = window_of(41, 37, 100, 128);
      const std::size_t covered = check_draw(b, records, w, what);
      if (i == 1) continue;  // the near plane has opened the surface
      EXPECT_EQ(covered, 41U * 37U) << what;
      expect_once(coverage_counts(b, records, w), w, what);
      // Nearness against the ray's own hit, within the change over the subpixel that corners snap to.
      const Visible v = device_draw(b, w);
      const ExactView exact_view(view);
      for (std::size_t k = 0; k < v.ids.size(); ++k) {
        if (v.ids[k] == 0xffffffffU) continue;
        const std::size_t row = k / 41;
        const double x = double(k % 41) + 100.0 / 256, y = double(row) + 0.5;
        const auto q = [&](double u, double t) {
          return 1 / glm::dot(hit_triangle(b, v.ids[k], exact_view, u, t).x - exact_view.origin, -exact_view.back);
        };
        const double step = 1.0 / 256, centre = q(x, y);
        const double slope = std::fabs(q(x + step, y) - centre) + std::fabs(q(x, y + step) - centre);
        double rounding = 0;  // of the least precise piece
        for (cl_uint r = 6 * v.ids[k]; r < 6 * v.ids[k] + 6; ++r)
          if (const RasterTriangle& t = records[r]; t.triangle != 0xffffffffU)
            rounding = std::max(rounding, rounding_unit(t, 3 * t.q_max, 256 * x - t.x0, 256 * y - t.y0));
        const double tolerance = 2 * slope + 2 * rounding;
        const double difference = std::fabs(double{std::bit_cast<float>(~v.depth[k])} - centre);
        const auto where = [&] { return fmt::format("{} pixel {}", what, k); };
        relative.add(difference / centre, where);
        worst.add(difference / tolerance, where);
      }
    }
    fmt::print("{}: {} extra records by clipping; nearness {:.2f} of tolerance ({}), {:.2g} of itself\n",
               cube ? "box" : "sphere", cut, worst.value, worst.where, relative.value);
    EXPECT_GT(cut, 20U);
    EXPECT_LE(worst.value, 1.0) << worst.where;
  }
}

TEST(Raster, CameraThatLooksAwaySeesNothing) {
  const Mesh mesh = icosphere(2);
  for (const glm::dvec3 target : {glm::dvec3(0, 0, 9), glm::dvec3(9, 0, 3), glm::dvec3(-3, 9, 4)}) {
    Scene scene = scene_of(mesh);
    scene.cameras = {{{0, 0, 3}, target, {0.1, 1, 0}, 20}};
    Bench b(scene);
    const std::vector<RasterTriangle> records = setup(b, pinhole_view(scene.cameras[0], b.plan.space, {32, 32}));
    EXPECT_EQ(check_draw(b, records, window_of(32, 32), "away"), 0U) << hex(target);
  }
}

}  // namespace
}  // namespace parian::test
