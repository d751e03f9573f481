// The questions of kernels/self_test.cl and the right answers to them, computed on the host.
#include "render/self_test.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <functional>
#include <limits>
#include <random>

#include "core/words.hpp"
#include "kernels/bssrdf.h"
#include "kernels/raster.h"
#include "scene/medium.hpp"

namespace parian {
namespace {

constexpr std::uint32_t items = SELF_TEST_ITEMS;

// OpenCL 1.2 allows 4 ulp of exp and sqrt in its embedded profile, a power of two more than what it allows elsewhere.
constexpr double function_tolerance = 4.0 / (1 << 23);
// Relative, of the sum of S_d and of single pairs: a few ulp in some thirty operations and in exp, a hundred times that
// where a pair's S_d happens to be a small difference.
constexpr double sum_tolerance = 1e-5, pair_tolerance = 1e-4;

/// The largest error relative to what is right, and where; a value that isn't finite is infinitely wrong.
struct Worst {
  double error = 0;
  std::size_t at = 0;
  void add(double found, double right, std::size_t i) {
    const double e = std::fabs(found - right) / std::max(std::fabs(right), 1e-30);
    if (e <= error) return;
    error = std::isnan(e) ? INFINITY : e;
    at = i;
  }
};

SelfTestAnswer layout_answer(const std::vector<cl_uint>& found) {
#define HOST_NAME(T, last) #T,
#define HOST_LAYOUT(T, last) sizeof(kernels::T), offsetof(kernels::T, last),
  constexpr std::array names{STRUCTS_THAT_CROSS(HOST_NAME)};
  constexpr std::array<std::size_t, 2 * names.size()> right{STRUCTS_THAT_CROSS(HOST_LAYOUT)};
  for (std::size_t i = 0; i < right.size(); ++i)
    if (found[i] != right[i])
      return {"struct layout",
              fmt::format("{} of {} is {}, not {}", i % 2 ? "the last field's offset" : "size", names[i / 2], found[i],
                          right[i]),
              false};
  return {"struct layout", fmt::format("{} structs alike", names.size()), true};
}

SelfTestAnswer function_answer(const char* name, const float* found, const std::vector<float>& arguments,
                               const std::function<double(double)>& f) {
  Worst worst;
  for (std::size_t i = 0; i < arguments.size(); ++i) worst.add(found[i], f(arguments[i]), i);
  return {name, fmt::format("worst relative error {:.2g}, at {:a}", worst.error, arguments[worst.at]),
          worst.error <= function_tolerance};
}

/// Pairs of points on flat ground, on slabs lit from behind and at any angle, in the order that the kernel loads.
std::vector<float> test_pairs(std::size_t count) {
  std::mt19937 engine(1);
  const auto uniform = [&](double a, double b) { return a + (b - a) * (double(engine()) / 4294967296.0); };
  const auto direction = [&](double low) {
    const double z = uniform(low, 1), phi = uniform(0, 2 * std::numbers::pi), s = std::sqrt(1 - z * z);
    return glm::dvec3(s * std::cos(phi), s * std::sin(phi), z);
  };
  std::vector<float> vectors(15 * count);
  for (std::size_t i = 0; i < count; ++i) {
    const double r = std::exp(uniform(std::log(0.05), std::log(20.0)));
    const glm::dvec3 flat = glm::normalize(direction(-1) * glm::dvec3(1, 1, 0));
    const glm::dvec3 n_o = i % 4 == 0 ? direction(0.5) : glm::dvec3(0, 0, i % 4 == 1 ? -1 : 1);
    const glm::dvec3 x = i % 4 == 1 ? flat * r - glm::dvec3(0, 0, 2) : flat * r;
    const std::array<glm::dvec3, 5> of_pair{glm::dvec3(0), direction(0.2), {0, 0, 1}, x, n_o};
    for (std::size_t c = 0; c < 15; ++c) vectors[c * count + i] = static_cast<float>(of_pair[c / 3][int(c % 3)]);
  }
  return vectors;
}

SelfTestAnswer dipole_answer(const float* found, const std::vector<float>& vectors, const ChannelConstants& channel,
                             Model model) {
  const std::size_t count = vectors.size() / 15;
  const kernels::ExactMedium medium = exact_medium(channel, model, 1);
  const kernels::ExactBoundary boundary = exact_boundary(channel);
  Worst worst;
  double sum = 0, right_sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto v = [&](std::size_t first) {
      return kernels::real3{vectors[first * count + i], vectors[(first + 1) * count + i],
                            vectors[(first + 2) * count + i]};
    };
    const kernels::DipoleGeometry g = kernels::dipole_geometry(
        kernels::real3_sub(v(9), v(0)), kernels::refract_into(v(3), v(6), boundary), v(6), v(12));
    const double right = exact_bssrdf(model, medium, boundary, g);
    worst.add(found[i], right, i);
    sum += found[i];
    right_sum += right;
  }
  const double of_sum = std::fabs(sum / right_sum - 1);
  return {"dipole sum",
          fmt::format("{} pairs: sum off by {:.2g} of itself, worst pair by {:.2g}", count, of_sum, worst.error),
          of_sum <= sum_tolerance && worst.error <= pair_tolerance};
}

/// Every work-item has the sum of i^2 + 1 over the items of its group.
SelfTestAnswer reduction_answer(const std::vector<cl_uint>& sums, std::size_t group) {
  for (std::size_t item = 0; item < items; ++item) {
    cl_uint right = 0;
    for (std::size_t i = item / group * group; i < (item / group + 1) * group; ++i)
      right += static_cast<cl_uint>(i * i + 1);
    if (sums[item] != right)
      return {"barrier reduction", fmt::format("the sum is {}, right is {}", sums[item], right), false};
  }
  return {"barrier reduction", fmt::format("all sums right in groups of {}", group), true};
}

kernels::RasterTriangle tile_triangle(std::array<glm::ivec2, 3> p, float q0, float q_x, float q_y, kernels::uint id) {
  kernels::RasterTriangle t{p[0].x, p[0].y, p[1].x, p[1].y, p[2].x, p[2].y, q0, q_x, q_y, q0, q0, id};
  for (const glm::ivec2& corner : p) {
    const float q = q0 + q_x * static_cast<float>(corner.x - p[0].x) + q_y * static_cast<float>(corner.y - p[0].y);
    t.q_min = std::min(t.q_min, q);
    t.q_max = std::max(t.q_max, q);
  }
  return t;
}

/// A tile of 16 x 16 with a shared edge through sample points, a triangle in front that pierces both, and its twin,
/// which ties with it everywhere. Integers and uncontracted floats: every bit must be the host's.
SelfTestAnswer raster_answer(Compute& compute) {
  constexpr int side = 16, px = SUBPIXELS, half = SUBPIXELS / 2;
  const glm::ivec2 a(half, half), b(half, 15 * px + half), c(15 * px + half, 15 * px + half), d(15 * px + half, half);
  const std::vector<kernels::RasterTriangle> triangles{
      tile_triangle({a, c, b}, 0.7F, 1.3e-5F, 2.9e-5F, 0), tile_triangle({a, d, c}, 0.7F, 1.3e-5F, 2.9e-5F, 1),
      tile_triangle({glm::ivec2(700, 300), {3901, 2000}, {300, 3001}}, 0.71F, 3.1e-6F, 3.7e-5F, 3),
      tile_triangle({glm::ivec2(700, 300), {3901, 2000}, {300, 3001}}, 0.71F, 3.1e-6F, 3.7e-5F, 2)};
  kernels::Window window{};
  window.width = window.height = side;
  window.sample_x = window.sample_y = half;

  const auto n = static_cast<cl_uint>(triangles.size());
  using Buffer = Compute::Temporary;
  Buffer records(compute, compute.upload(triangles)), large(compute, compute.buffer<cl_uint>(n));
  Buffer n_large(compute, compute.upload(std::vector<cl_uint>{0}));
  Buffer depth(compute, compute.upload(std::vector<cl_uint>(side * side, NO_DEPTH)));
  Buffer ids(compute, compute.upload(std::vector<cl_uint>(side * side, NO_TRIANGLE)));
  compute.launch("raster_depth", n, Stage::plan, window, depth, records, n, n_large, large, depth);
  compute.launch("raster_ids", n, Stage::plan, window, depth, records, n, depth, ids);
  const std::vector<cl_uint> depths = compute.read<cl_uint>(depth, side * side),
                             found = compute.read<cl_uint>(ids, side * side);
  for (cl::Buffer* buffer : {&records, &large, &n_large, &depth, &ids}) compute.release(*buffer);

  std::size_t wrong = 0, drawn = 0;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      kernels::uint id = NO_TRIANGLE, nearest = NO_DEPTH;
      for (const kernels::RasterTriangle& t : triangles) {
        if (!kernels::covers(t, x * px + half, y * px + half)) continue;
        const float q = kernels::nearness(t, x * px + half, y * px + half);
        kernels::uint key = 0;
        std::memcpy(&key, &q, sizeof key);
        key = ~key;
        if (key < nearest || (key == nearest && t.triangle < id)) id = t.triangle, nearest = key;
      }
      drawn += id != NO_TRIANGLE;
      const std::size_t at = std::size_t(y) * side + x;
      wrong += found[at] != id || depths[at] != nearest;
    }
  return {"raster tile",
          fmt::format("{} of {} pixels differ in triangle or depth, {} are covered", wrong, side * side, drawn),
          wrong == 0};
}

}  // namespace

std::string self_test_options(Model model, std::uint32_t lanes) {
  return fmt::format("-cl-std=CL1.2 -DVW={} -DMODEL={} -DRECORDS=1", lanes, static_cast<int>(model));
}

std::vector<SelfTestAnswer> self_test(Compute& compute, Model model, std::uint32_t lanes, const std::string& source) {
  compute.build(self_test_options(model, lanes), source);
  const std::size_t count = std::size_t{items} * lanes;
  std::vector<float> arguments(count);  // 1e-6 to 60, evenly in the logarithm: smaller exponentials matter nowhere
  for (std::size_t i = 0; i < count; ++i)
    arguments[i] = static_cast<float>(1e-6 * std::pow(6e7, static_cast<double>(i) / static_cast<double>(count - 1)));
  const ChannelConstants channel = channel_constants(1.0, 0.01, 0.0, 1.3);
  const std::vector<float> vectors = test_pairs(count);

  constexpr std::size_t functions = 5, layout_size = 64;
  using Buffer = Compute::Temporary;
  Buffer given(compute, compute.upload(arguments)), pairs(compute, compute.upload(vectors));
  Buffer layout(compute, compute.upload(std::vector<cl_uint>(layout_size)));
  Buffer reduced(compute, compute.buffer<cl_uint>(items));
  Buffer minimum(compute, compute.upload(std::vector<cl_uint>{0xffffffffU}));
  Buffer values(compute, compute.upload(std::vector<float>(functions * count, NAN)));
  compute.launch("self_test", items, Stage::plan, device_medium(channel, model, 1),
                 device_boundary(exact_boundary(channel)), given, pairs, layout, reduced, minimum, values);
  const std::vector<float> found = compute.read<float>(values, functions * count);
  const std::vector<cl_uint> sums = compute.read<cl_uint>(reduced, items);
  const cl_uint least = compute.read<cl_uint>(minimum, 1)[0];

  std::vector<SelfTestAnswer> answers{layout_answer(compute.read<cl_uint>(layout, layout_size))};
  const auto f = [&](const char* name, std::size_t which, double (*exact)(double)) {
    answers.push_back(function_answer(name, found.data() + which * count, arguments, exact));
  };
  f("exp", 0, [](double x) { return std::exp(-x); });
  f("expm1", 1, [](double x) { return std::expm1(-x); });
  f("sqrt", 2, [](double x) { return std::sqrt(x); });
  f("rsqrt", 3, [](double x) { return 1 / std::sqrt(x); });
  answers.push_back(reduction_answer(sums, compute.group_size("self_test")));
  answers.push_back(
      {"atomic minimum", fmt::format("{}, right is {}", least, SELF_TEST_MINIMUM), least == SELF_TEST_MINIMUM});
  answers.push_back(raster_answer(compute));
  answers.push_back(dipole_answer(found.data() + 4 * count, vectors, channel, model));
  for (cl::Buffer* buffer : {&given, &pairs, &layout, &reduced, &minimum, &values}) compute.release(*buffer);
  return answers;
}

std::vector<std::string> require_sound(Compute& compute, const Settings& settings, std::uint32_t lanes,
                                       const std::string& source) {
  std::vector<std::string> warnings;
  for (const SelfTestAnswer& answer : self_test(compute, settings.model, lanes, source)) {
    if (answer.passed) continue;
    const std::string what =
        fmt::format("{}: the device fails the self-test '{}' ({})", compute.info().name, answer.name, answer.found);
    if (!settings.force)
      throw Error(ErrorKind::device,
                  fmt::format("{}; update its driver, choose another{}, or render all the same with {}", what,
                              setting("with_device"), setting("force")));
    warnings.push_back(what + "; the picture may be wrong");
  }
  return warnings;
}

}  // namespace parian
