// The sequences of samples: how good their lattices are, and that neighbours have the parts of a finer one.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>
#include <set>
#include <utility>

#include "kernels/sampling.h"

namespace parian {
namespace {

using kernels::class_of_point, kernels::point_number;

/// Sum of |k|^-3 over the lattice spanned by a and b but for 0, up to a few dozen steps of a reduced basis (Gauss).
double sum_over(glm::dvec2 a, glm::dvec2 b) {
  for (;;) {
    if (glm::dot(a, a) < glm::dot(b, b)) std::swap(a, b);
    const glm::dvec2 shorter = a - std::round(glm::dot(a, b) / glm::dot(b, b)) * b;
    if (glm::dot(shorter, shorter) > 0.999 * glm::dot(a, a)) break;
    a = shorter;
  }
  constexpr int reach = 24;
  double sum = 0;
  for (int i = -reach; i <= reach; ++i)
    for (int j = -reach; j <= reach; ++j)
      if (i != 0 || j != 0) sum += std::pow(glm::length(double(i) * a + double(j) * b), -3);
  return sum;
}

/// Of the dual of a lattice of n points with generator (1, z) / n, in units of the hexagonal lattice's of as many
/// points: no lattice's is less (Montgomery 1988).
double merit(std::uint64_t n, std::uint64_t z) {
  const auto points = double(n);
  const double side = std::sqrt(points * 2 / std::numbers::sqrt3);
  const double least = sum_over(glm::dvec2(side, 0), glm::dvec2(side / 2, side * std::numbers::sqrt3 / 2));
  return sum_over(glm::dvec2(points, 0), glm::dvec2(-double(z % n), 1)) / least;
}

TEST(Sampling, LatticesOfAllSizesAreGood) {
  double worst = 0, worst_of_blocks = 0;
  for (int m = 0; m <= 22; ++m) {
    worst = std::max(worst, merit(std::uint64_t{1} << m, LATTICE_V));
    worst_of_blocks = std::max(worst_of_blocks, merit(std::uint64_t{9} << m, LATTICE_V));
  }
  fmt::print("sums over dual lattices: {:.3f} times the least, {:.3f} of whole blocks\n", worst, worst_of_blocks);
  EXPECT_LE(worst, 1.33);
  EXPECT_LE(worst_of_blocks, 1.33);
  EXPECT_GT(merit(4096, 1), 10) << "a diagonal";
}

TEST(Sampling, TexelsOfABlockMakeOneLattice) {
  for (const std::uint32_t m : {0U, 3U, 6U, 10U}) {
    const std::uint32_t n = 1U << m;
    std::set<std::int64_t> found;
    for (std::uint32_t i = 0; i < n; ++i)
      for (std::uint32_t c = 0; c < 9; ++c) {
        const auto place = static_cast<std::uint32_t>(std::uint64_t{i} << (32 - m));
        const double u = (place + c * CLASS_STEP_U) * 0x1p-32, v = (place * LATTICE_V + c * CLASS_STEP_V) * 0x1p-32;
        const std::int64_t k = std::llround(u * 9 * n);
        const double off = v - double(k) * LATTICE_V / (9.0 * n);
        EXPECT_NEAR(off, std::round(off), 1e-6) << n << " points, " << i << " of texel " << c;
        found.insert(k);
      }
    EXPECT_EQ(found.size(), std::size_t{9} * n);
  }
}

TEST(Sampling, EveryTexelHasItsOwnNumber) {
  constexpr std::uint32_t width = 20, height = 13;
  std::set<std::uint32_t> numbers, blocks;
  for (std::uint32_t film = 0; film < 3; ++film)
    for (std::uint32_t y = 0; y < height; y += 3)
      for (std::uint32_t x = 0; x < width; x += 3) {
        std::set<std::uint32_t> classes;
        const std::uint32_t block = kernels::block_of_point(point_number(film, width, height, x, y));
        EXPECT_TRUE(blocks.insert(block).second);
        for (std::uint32_t k = 0; k < 9; ++k) {
          const std::uint32_t number = point_number(film, width, height, x + k % 3, y + k / 3);
          EXPECT_TRUE(numbers.insert(number).second);
          EXPECT_EQ(kernels::block_of_point(number), block);
          EXPECT_EQ(class_of_point(number | 0x80000000U), class_of_point(number));
          classes.insert(class_of_point(number));
        }
        EXPECT_EQ(classes.size(), 9U);
      }
}

}  // namespace
}  // namespace parian
