// Pass 3 level by level against its description in double, and what a bilateral filter must keep.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "passes/pyramids.hpp"
#include "test_scene.hpp"

namespace parian::test {
namespace {

using kernels::float4;

constexpr cl_uint empty = 0xffffffffU;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

/// Level 0 of some layers; texels with slot `empty` hold NaN.
struct Base {
  cl_uint size, count;
  std::vector<float4> geometry;  // n_g in the layer's frame, q
  std::vector<cl_uint> slots;
  std::vector<float4> values;  // halves A and B of each slot
};

/// All levels as the device made them.
struct Chain {
  std::vector<cl_uint> first, side;
  std::vector<float4> geometry, values;
  std::vector<cl_uint> slots;
};

float4 facing(double nx, double ny, double q) {
  const double nz = std::sqrt(1 - nx * nx - ny * ny);
  return {float(nx), float(ny), float(nz), float(q)};
}

/// Fills every texel from a function of layer, column and row that gives geometry, or NaN where there is nothing.
Base make_base(cl_uint size, cl_uint count, const std::function<float4(cl_uint, cl_uint, cl_uint)>& geometry,
               const std::function<double(cl_uint, cl_uint)>& value) {
  Base b{size, count, {}, {}, {}};
  cl_uint n = 0;
  for (cl_uint layer = 0; layer < count; ++layer)
    for (cl_uint y = 0; y < size; ++y)
      for (cl_uint x = 0; x < size; ++x) {
        b.geometry.push_back(geometry(layer, x, y));
        const bool there = b.geometry.back().w == b.geometry.back().w;
        b.slots.push_back(there ? n++ : empty);
        if (!there) continue;
        const auto v = float(value(x, y));
        b.values.push_back({v, 0.5F * v, 0.25F * v, 0});
        b.values.push_back({0.75F * v, v, 2 * v, 0});
      }
  return b;
}

class Pyramids : public testing::Test {
 protected:
  static void SetUpTestSuite() { bench_ = std::make_unique<Bench>(scene_of(icosphere(1))); }
  static void TearDownTestSuite() { bench_.reset(); }
  static constexpr float scale = 8;  // texels per unit

  static Chain build(const Base& base) {
    Compute& compute = bench_->compute;
    Layers& k = bench_->passes.layers;
    k = {};
    Chain c;
    c.first = {0};
    for (cl_uint side = base.size;; side = (side + 1) / 2) {
      c.side.push_back(side);
      c.first.push_back(c.first.back() + side * side * base.count);
      if (side == 1) break;
    }
    const std::size_t n = base.values.size() / 2, texels = base.slots.size(), all = c.first.back();
    for (cl_uint layer = 0; layer < base.count; ++layer) {
      kernels::View v = orthographic_view({{-1, -1, -1}, {1, 1, 1}}, {0, 0, 1}, base.size);
      v.scale = scale;
      k.views.push_back(v);
    }
    k.levels = cl_uint(c.side.size()), k.n_points = cl_uint(n), k.level_first = c.first;
    k.views_buffer = compute.upload(k.views);
    k.level_first_buffer = compute.upload(k.level_first);
    std::vector<float4> geometry(all, {nan, nan, nan, nan}), values(2 * (n + all - texels), {nan, nan, nan, nan});
    std::vector<cl_uint> slots(all, 12345);
    std::copy(base.geometry.begin(), base.geometry.end(), geometry.begin());
    std::copy(base.values.begin(), base.values.end(), values.begin());
    std::copy(base.slots.begin(), base.slots.end(), slots.begin());
    k.geometry = compute.upload(geometry), k.values = compute.upload(values), k.slots = compute.upload(slots);
    build_pyramids(bench_->passes, k.levels - 1);
    c.geometry = compute.read<float4>(k.geometry, all);
    c.values = compute.read<float4>(k.values, values.size());
    c.slots = compute.read<cl_uint>(k.slots, all);
    return c;
  }
  static std::unique_ptr<Bench> bench_;
};
std::unique_ptr<Bench> Pyramids::bench_;

struct Texel {
  glm::dvec3 n, at, a, b;
  double coverage;
};

/// How far a parent is from what its children give with child `r` as the one it takes after, in units of tolerance.
double difference(const std::vector<Texel>& children, std::size_t r, double side, const float4& geometry,
                  const float4& a, const float4& b, double* sum) {
  glm::dvec3 n{}, at{}, sum_a{}, sum_b{};
  double total = 0, brightest = 0;
  for (const Texel& c : children) {
    const double alike = std::max(glm::dot(children[r].n, c.n), 0.0),
                 off = glm::dot(c.at - children[r].at, children[r].n) / side;
    const double w = c.coverage * alike * alike * std::max(1 - off * off, 0.0);
    total += w, n += w * c.n, at += w * c.at, sum_a += w * c.a, sum_b += w * c.b;
    brightest = std::max({brightest, glm::length(c.a), glm::length(c.b)});
  }
  *sum = total;
  n = glm::normalize(n), at /= total;
  const double slope = std::max(n.z, 0.1), q = at.z + (n.x * at.x + n.y * at.y) / slope;
  // Weights carry a few roundings of 2^-24, of nearness (2 to 3) over the texel's side where they come from the plane.
  const double tolerance = 2e-6 + 4 * 0x1p-22 / side;
  return largest({glm::length(exact(geometry) - n) / tolerance, std::fabs(geometry.w - q) / (tolerance / slope),
                  glm::length(exact(a) - sum_a / total) / (tolerance * brightest),
                  glm::length(exact(b) - sum_b / total) / (tolerance * brightest),
                  std::fabs(a.w - total) / (tolerance * total), std::fabs(b.w - total) / (tolerance * total)});
}

TEST_F(Pyramids, AgreeWithTheirDescriptionInDouble) {
  Worst worst;
  std::size_t parents = 0, whole = 0;
  for (const cl_uint size : {32U, 7U, 5U, 3U, 2U, 1U}) {
    Random random(size);
    // A wavy surface with steps, creases and holes.
    const Base base = make_base(
        size, 3,
        [&](cl_uint layer, cl_uint x, cl_uint y) -> float4 {
          if (random(0, 1) < 0.15) return {nan, nan, nan, nan};
          const double side = (x + y / 2) % 11 < 5 ? 0.5 : -0.3, step = layer == 1 && x > size / 2 ? 0.4 : 0.0;
          return facing(side + random(-0.1, 0.1), random(-0.2, 0.2),
                        2 + step - (side * x) / scale + random(-0.02, 0.02));
        },
        [&](cl_uint, cl_uint) { return random(0, 3); });
    const Chain c = build(base);
    for (std::size_t level = 1; level < c.side.size(); ++level)
      for (cl_uint i = 0; i < c.first[level + 1] - c.first[level]; ++i) {
        const cl_uint per_layer = c.side[level] * c.side[level], layer = i / per_layer;
        const cl_uint x = i % c.side[level], y = i % per_layer / c.side[level], below = c.side[level - 1];
        const double side = std::pow(2.0, level - 1) / scale;
        std::vector<Texel> children;
        for (cl_uint cy = 2 * y; cy < std::min(2 * y + 2, below); ++cy)
          for (cl_uint cx = 2 * x; cx < std::min(2 * x + 2, below); ++cx) {
            const cl_uint t = c.first[level - 1] + layer * below * below + cy * below + cx, slot = c.slots[t];
            if (slot == empty) continue;
            const glm::dvec3 at((cx + 0.5 - 2.0 * x - 1) * side, (cy + 0.5 - 2.0 * y - 1) * side, c.geometry[t].w);
            children.push_back({exact(c.geometry[t]), at, exact(c.values[2 * slot]), exact(c.values[2 * slot + 1]),
                                level > 1 ? c.values[2 * slot].w : 1.0});
          }
        const cl_uint slot = c.slots[c.first[level] + i];
        ASSERT_EQ(slot == empty, children.empty());
        if (children.empty()) {
          const float4 g = c.geometry[c.first[level] + i];
          ASSERT_TRUE(g.x == 0 && g.y == 0 && g.z == 0 && g.w == 0) << size << " level " << level << " texel " << i;
          continue;
        }
        // The child that agrees best with all is up to rounding when two are as good.
        double best = 0, nearest = INFINITY;
        std::vector<double> sums(children.size()), off(children.size());
        for (std::size_t r = 0; r < children.size(); ++r) {
          off[r] = difference(children, r, side, c.geometry[c.first[level] + i], c.values[2 * slot],
                              c.values[2 * slot + 1], &sums[r]);
          best = std::max(best, sums[r]);
        }
        for (std::size_t r = 0; r < children.size(); ++r)
          if (sums[r] >= best * (1 - 1e-5)) nearest = std::min(nearest, off[r]);
        ++parents, whole += children.size() == 4;
        worst.add(nearest, [&] { return fmt::format("size {} level {} texel {}", size, level, i); });
      }
  }
  fmt::print("{} parents, {} with four children; worst {:.2f} of tolerance ({})\n", parents, whole, worst.value,
             worst.where);
  EXPECT_GT(whole, 300U);
  EXPECT_LE(worst.value, 1) << worst.where;
}

TEST_F(Pyramids, ConstantsStayAndEmptyTexelsDoNotBleed) {
  for (const cl_uint size : {16U, 7U, 5U, 3U}) {
    Random random(size);
    const Base base = make_base(
        size, 2,
        [&](cl_uint, cl_uint x, cl_uint) -> float4 {
          if (random(0, 1) < 0.4) return {nan, nan, nan, nan};
          return facing(random(-0.3, 0.3), 0.1, 2 + 0.01 * x);
        },
        [](cl_uint, cl_uint) { return 0.7; });
    const Chain c = build(base);
    Worst worst;
    for (std::size_t t = c.first[1]; t < c.slots.size(); ++t) {
      if (c.slots[t] == empty) continue;
      const float4 a = c.values[2 * c.slots[t]], b = c.values[2 * c.slots[t] + 1];
      const glm::dvec3 wrong_a = exact(a) / 0.7 - glm::dvec3(1, 0.5, 0.25),
                       wrong_b = exact(b) / 0.7 - glm::dvec3(0.75, 1, 2);
      worst.add(largest({glm::length(wrong_a), glm::length(wrong_b)}), "");
      EXPECT_TRUE(a.w > 0 && std::isfinite(c.geometry[t].w) && std::isfinite(c.geometry[t].x)) << t;
    }
    EXPECT_NE(c.slots.back(), empty);
    fmt::print("size {}: a constant changes by {:.2g}\n", size, worst.value);
    EXPECT_LE(worst.value, 1e-6);  // three roundings of 6e-8 per level
  }
}

TEST_F(Pyramids, AreLinearInTheValues) {
  Random random(4);
  const auto geometry = [](cl_uint, cl_uint x, cl_uint y) { return facing(0.3 * std::sin(x), 0.2 * std::cos(y), 2.0); };
  const Base one = make_base(11, 2, geometry, [&](cl_uint, cl_uint) { return random(0, 1); });
  const Base two = make_base(11, 2, geometry, [&](cl_uint, cl_uint) { return random(0, 9); });
  Base twice = one, sum = one;
  for (std::size_t i = 0; i < one.values.size(); ++i)
    for (float float4::*f : {&float4::x, &float4::y, &float4::z})
      twice.values[i].*f *= 2, sum.values[i].*f += two.values[i].*f;
  const Chain a = build(one), b = build(two), d = build(twice), s = build(sum);
  for (std::size_t i = one.values.size(); i < a.values.size(); ++i)
    for (float float4::*f : {&float4::x, &float4::y, &float4::z}) {
      ASSERT_EQ(d.values[i].*f, 2 * a.values[i].*f) << i;
      ASSERT_NEAR(s.values[i].*f, a.values[i].*f + b.values[i].*f, 1e-6 * (s.values[i].*f)) << i;
    }
}

TEST_F(Pyramids, EdgesDoNotMix) {
  // Two sides with values 1 and 100, their border inside of blocks: at different depth, or facing away from each other.
  for (const bool depth : {true, false}) {
    const Base base = make_base(
        16, 1,
        [&](cl_uint, cl_uint x, cl_uint) {
          const bool left = x < 5;
          return depth ? facing(0, 0, left ? 2.0 : 2.5) : facing(left ? -0.8 : 0.8, 0, 2.0);
        },
        [](cl_uint x, cl_uint) { return x < 5 ? 1.0 : 100.0; });
    const Chain c = build(base);
    // A step of half a unit is four texels: from level 3 on it lies within a texel.
    for (std::size_t t = c.first[1]; t < c.first[depth ? 3 : 4]; ++t) {
      const float v = c.values[2 * c.slots[t]].x;
      EXPECT_TRUE(std::fabs(v - 1) < 1e-6 || std::fabs(v - 100) < 1e-4)
          << (depth ? "depth" : "facing") << t << " " << v;
    }
  }
}

TEST_F(Pyramids, CoverageAddsUp) {
  for (const cl_uint size : {8U, 7U, 5U, 1U}) {
    const Chain c = build(make_base(
        size, 1, [](cl_uint, cl_uint, cl_uint) { return facing(0, 0, 2.25); }, [](cl_uint, cl_uint) { return 1.0; }));
    for (std::size_t level = 1; level < c.side.size(); ++level) {
      double sum = 0;
      for (cl_uint t = c.first[level]; t < c.first[level + 1]; ++t) sum += c.values[2 * c.slots[t]].w;
      EXPECT_EQ(sum, double(size) * size) << "size " << size << " level " << level;
    }
  }
}

}  // namespace
}  // namespace parian::test
