// Measures of error against numbers worked out by hand, and what is refused.
#include "truth/compare.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.hpp"

namespace parian {
namespace {

/// Opaque grey pixels in one row.
Image row(const std::vector<float>& values) {
  Image image{static_cast<std::uint32_t>(values.size()), 1, {}};
  for (const float v : values) image.rgba.insert(image.rgba.end(), {v, v, v, 1.0F});
  return image;
}

std::string refusal(const Image& picture, const Image& reference) {
  try {
    (void)compare(picture, reference);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    return error.what();
  }
  return {};
}

// Pictures are of single precision, so sums agree with numbers on paper to 1e-6.
constexpr double rounding = 1e-6;

TEST(CompareTest, EqualPicturesDontDiffer) {
  const Image image = row({0.5F, 0.0F, 2.0F});
  const Comparison c = compare(image, image);
  EXPECT_EQ(c.pixels, 3U);
  EXPECT_EQ(c.relmse, 0.0);
  EXPECT_EQ(c.rmse, 0.0);
  EXPECT_EQ(c.relmse_p99, 0.0);
  EXPECT_EQ(c.max_abs, 0.0);
  EXPECT_EQ(c.mean_ratio[1], 1.0);
  EXPECT_LT(c.relmse_edge, 0.0) << "there is no edge";
  EXPECT_LT(c.reference_relmse, 0.0) << "the reference doesn't know its error";
}

TEST(CompareTest, NumbersWorkedOutByHand) {
  // R = 1 and 3, I = 1.1 and 2.7: eps = 0.02, so relMSE = (0.01 / 1.0004 + 0.09 / 9.0004) / 2.
  const Comparison c = compare(row({1.1F, 2.7F}), row({1.0F, 3.0F}));
  const double relmse = 0.5 * (0.01 / 1.0004 + 0.09 / 9.0004);
  EXPECT_NEAR(c.relmse, relmse, rounding);
  EXPECT_NEAR(c.relmse_uncorrected, relmse, rounding);
  EXPECT_NEAR(c.rmse, std::sqrt(0.05), rounding);
  EXPECT_NEAR(c.mean_ratio[0], 3.8 / 4.0, rounding);
  EXPECT_NEAR(c.max_abs, 0.3, rounding);
  EXPECT_EQ(c.max_pixel[0], 1U);
  EXPECT_EQ(c.max_pixel[1], 0U);
}

TEST(CompareTest, ChannelsCountOneByOne) {
  Image picture = row({1.0F}), reference = row({1.0F});
  picture.rgba = {1.0F, 1.5F, 1.0F, 1.0F};
  reference.rgba = {1.0F, 1.0F, 4.0F, 1.0F};  // mean 2, eps 0.02
  const Comparison c = compare(picture, reference);
  EXPECT_NEAR(c.relmse, (0.25 / 1.0004 + 9.0 / 16.0004) / 3, rounding);
  EXPECT_NEAR(c.mean_ratio[0], 1.0, rounding);
  EXPECT_NEAR(c.mean_ratio[1], 1.5, rounding);
  EXPECT_NEAR(c.mean_ratio[2], 0.25, rounding);
}

TEST(CompareTest, VariancesAreSubtracted) {
  Image picture = row({1.1F, 1.0F}), reference = row({1.0F, 1.0F});
  reference.standard_error.assign(6, 0.05F);
  const double norm = 1.0001;
  Comparison c = compare(picture, reference);
  EXPECT_NEAR(c.relmse_uncorrected, 0.005 / norm, rounding);
  EXPECT_NEAR(c.reference_relmse, 0.0025 / norm, rounding);
  EXPECT_NEAR(c.relmse, 0.0025 / norm, rounding);
  EXPECT_NEAR(c.rmse, 0.05, rounding);
  picture.standard_error.assign(6, 0.2F);  // more noise than difference: no less than 0
  c = compare(picture, reference);
  EXPECT_EQ(c.relmse, 0.0);
  EXPECT_EQ(c.rmse, 0.0);
  EXPECT_NEAR(c.reference_relmse, 0.0025 / norm, rounding);
}

TEST(CompareTest, ErrorsCanBeRelativeToAnotherPicture) {
  Image limit = row({1.0F, 1.0F, 1.0F}), scale = row({2.0F, 2.0F, 9.0F});
  limit.standard_error.assign(9, 0.05F);
  scale.rgba[11] = 0.5F;  // not of M
  const Comparison c = compare(row({1.1F, 1.1F, 7.0F}), limit, scale);
  const double norm = 4.0004;
  EXPECT_EQ(c.pixels, 2U);
  EXPECT_NEAR(c.relmse, 0.0075 / norm, rounding);
  EXPECT_NEAR(c.reference_relmse, 0.0025 / norm, rounding);
  EXPECT_NEAR(c.rmse, std::sqrt(0.0075), rounding);
}

TEST(CompareTest, PixelsTellTheirPart) {
  Image picture = row({1.1F, 2.7F, 5.0F});
  picture.rgba[11] = 0.5F;
  const std::vector<double> errors = pixel_errors(picture, row({1.0F, 3.0F, 1.0F}));
  ASSERT_EQ(errors.size(), 3U);
  EXPECT_NEAR(errors[0], 0.01 / 1.0004, rounding);
  EXPECT_NEAR(errors[1], 0.09 / 9.0004, rounding);
  EXPECT_LT(errors[2], 0.0) << "not covered fully";
}

TEST(CompareTest, TheWorstPercentIsLeftOut) {
  std::vector<float> values(200, 1.0F), wrong = values;
  for (std::size_t i = 0; i < 200; ++i) wrong[i] = 1.1F;
  wrong[7] = 100.0F;
  wrong[150] = 50.0F;
  EXPECT_NEAR(compare(row(wrong), row(values)).relmse_p99, 0.01 / 1.0001, rounding);
  EXPECT_GT(compare(row(wrong), row(values)).relmse, 10.0);
}

TEST(CompareTest, EdgesAndBackgroundCountApart) {
  Image picture = row({1.0F, 0.6F, 9.0F}), reference = row({1.0F, 0.5F, 0.0F});
  picture.rgba[7] = reference.rgba[7] = 0.5F;    // an edge in both
  picture.rgba[11] = reference.rgba[11] = 0.0F;  // background, whatever its colour
  const Comparison c = compare(picture, reference);
  EXPECT_EQ(c.pixels, 1U);
  EXPECT_EQ(c.relmse, 0.0);
  EXPECT_NEAR(c.relmse_edge, 0.01 / 0.2501, rounding);
  picture.rgba[11] = 1.0F;  // covered in one of them only
  EXPECT_EQ(compare(picture, reference).pixels, 1U);
  EXPECT_GT(compare(picture, reference).relmse_edge, 1.0);
}

TEST(CompareTest, BlackReferences) {
  EXPECT_EQ(compare(row({0.0F}), row({0.0F})).relmse, 0.0);
  EXPECT_EQ(compare(row({0.0F}), row({0.0F})).mean_ratio[0], 1.0);
  EXPECT_TRUE(std::isinf(compare(row({0.1F}), row({0.0F})).relmse));
}

TEST(CompareTest, Refusals) {
  EXPECT_NE(refusal(row({1.0F}), row({1.0F, 1.0F})).find("1x1 pixels and the reference 2x1"), std::string::npos);
  EXPECT_NE(refusal(row({NAN}), row({1.0F})).find("the picture has a value that isn't finite"), std::string::npos);
  EXPECT_NE(refusal(row({1.0F}), row({INFINITY})).find("the reference has a value"), std::string::npos);
  Image empty = row({1.0F});
  empty.rgba[3] = 0.998F;
  EXPECT_NE(refusal(empty, row({1.0F})).find("no pixel is covered"), std::string::npos);
  Image reference = row({1.0F});
  reference.standard_error = {0.1F, NAN, 0.1F};
  EXPECT_NE(refusal(row({1.0F}), reference).find("the reference has a value"), std::string::npos);
}

TEST(CompareTest, DifferencesAreColoured) {
  const Image image = signed_difference(row({1.0F, 1.2F, 0.9F}), row({1.0F, 1.0F, 1.0F}), 0.1);
  const auto pixel = [&](int i) {
    return std::vector<float>(image.rgba.begin() + 4 * i, image.rgba.begin() + 4 * i + 4);
  };
  EXPECT_EQ(pixel(0), (std::vector<float>{1, 1, 1, 1}));  // equal
  EXPECT_EQ(pixel(1), (std::vector<float>{1, 0, 0, 1}));  // brighter by more than the scale
  EXPECT_NEAR(pixel(2)[0], 0.0F, 1e-3);                   // darker by the scale, eps aside
  EXPECT_EQ(pixel(2)[2], 1.0F);
}

}  // namespace
}  // namespace parian
