// Pictures that promise what they don't hold, and references that claim what can't be.
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "core/error.hpp"
#include "io/image_file.hpp"
#include "scratch.hpp"
#include "truth/reference.hpp"

namespace parian {
namespace {

using test::read_bytes;
using test::Scratch;

std::string refusal(const std::filesystem::path& path) {
  try {
    (void)read_image(path);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    std::string message = error.what();
    EXPECT_TRUE(message.starts_with(path.string())) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return message;
  }
  return "nothing";
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// Most memory that this process has ever had, in bytes.
double peak() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1024.0 * static_cast<double>(usage.ru_maxrss);
}

Image grey(std::uint32_t width, std::uint32_t height, float value) {
  return {width, height, std::vector<float>(std::size_t{4} * width * height, value)};
}

/// Writes an EXR as OpenImageIO does, with any compression and tiles.
void write_exr(const std::filesystem::path& path, int width, int height, const std::string& compression, int tile = 0) {
  OIIO::ImageSpec spec(width, height, 4, OIIO::TypeFloat);
  spec.attribute("compression", compression);
  spec.tile_width = spec.tile_height = tile;
  const auto output = OIIO::ImageOutput::create("a.exr");
  ASSERT_TRUE(output && output->open(path.string(), spec));
  std::vector<float> values(std::size_t{4} * width * height);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i % 251);
  ASSERT_TRUE(output->write_image(OIIO::TypeFloat, values.data()) && output->close());
}

/// A TIFF of floats in one strip that holds four bytes.
std::string lying_tiff(std::uint16_t side) {
  std::string bytes("II*\0\x08\0\0\0", 8);
  const auto append = [&](std::uint32_t number, int count) {
    for (int i = 0; i < count; ++i) bytes += static_cast<char>(number >> 8 * i);
  };
  const std::vector<std::array<std::uint32_t, 2>> tags{{256, side}, {257, side}, {258, 32},   {259, 1}, {262, 2},
                                                       {273, 122},  {277, 3},    {278, side}, {279, 4}};
  append(static_cast<std::uint32_t>(tags.size()), 2);
  for (const auto& [tag, value] : tags) {
    append(tag, 2);
    append(4, 2);  // a 32-bit number
    append(1, 4);
    append(value, 4);
  }
  append(0, 4);
  return bytes + "abcd";
}

/// Replaces the four numbers of an EXR's data window.
std::string with_window(std::string exr, std::array<std::int32_t, 4> window) {
  for (const char* name : {"dataWindow", "displayWindow"}) {
    const std::size_t at = exr.find(name) + std::strlen(name) + 1 + std::strlen("box2i") + 1 + 4;
    std::memcpy(&exr[at], window.data(), sizeof window);
  }
  return exr;
}

TEST(DamagedPicture, PromisesAreHeldAgainstTheFileBeforeAnythingIsAllocated) {
  const Scratch scratch;
  write_image(scratch / "small.exr", grey(8, 8, 1), {}, {});
  const std::string small = read_bytes(scratch / "small.exr");
  (void)read_image(scratch / "small.exr");  // loads what reading needs
  const double before = peak();
  for (const std::array<std::int32_t, 4>& window : {std::array{0, 0, 16383, 8191},
                                                    {0, 0, 16383, 16383},
                                                    {0, 0, 8191, 16383},
                                                    {0, 0, 100000, 100},
                                                    {-5, -5, 100, 70000}}) {
    scratch.write("lies.exr", with_window(small, window));
    const std::string said = refusal(scratch / "lies.exr");
    EXPECT_TRUE(has(said, "which don't fit into its") || has(said, "more than 16384 along a side") ||
                has(said, "no picture that can be read"))
        << said;
  }
  // As many chunks as promised, so that OpenEXR has nothing against the file.
  write_exr(scratch / "thin.exr", 1, 8192, "dwab");
  scratch.write("lies.exr", with_window(read_bytes(scratch / "thin.exr"), {0, 0, 16383, 8191}));
  EXPECT_TRUE(has(refusal(scratch / "lies.exr"), "promises 16384x8192 pixels of 4 channels, which don't fit into its"));
  // Other formats promise too. The header of a PFM is text, and an RGBE's is.
  scratch.write("a.pfm", "PF\n16384 16384\n-1.0\nabcd");
  EXPECT_NE(refusal(scratch / "a.pfm"), "nothing");
  scratch.write("a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16384 +X 16384\nabcd");
  EXPECT_NE(refusal(scratch / "a.hdr"), "nothing");
  scratch.write("a.tif", lying_tiff(16384));
  EXPECT_NE(refusal(scratch / "a.tif"), "nothing");
  std::string fits;
  for (const char* card :
       {"SIMPLE  =                    T", "BITPIX  =                  -32", "NAXIS   =                    3",
        "NAXIS1  =                16384", "NAXIS2  =                16384", "NAXIS3  =                    3", "END"})
    fits += fmt::format("{:<80}", card);
  scratch.write("a.fits", fmt::format("{:<2880}", fits) + "abcd");
  EXPECT_NE(refusal(scratch / "a.fits"), "nothing");
  // What has no magic number takes anything for its own: only the format that the name asks for is tried.
  scratch.write("text.exr", "x" + small);
  EXPECT_TRUE(has(refusal(scratch / "text.exr"), "no picture that can be read"));
  // So do attributes of a header, which OpenEXR allocates as they say.
  std::string attribute = small;
  const std::string name = std::string("Software\0string", 15);
  const std::size_t at = attribute.find(name) + name.size() + 1;
  ASSERT_LT(at, attribute.size());
  attribute[at + 3] = '\x7f';
  scratch.write("attribute.exr", attribute);
  EXPECT_TRUE(has(refusal(scratch / "attribute.exr"), "promises an attribute of 2130706"));
  for (const std::size_t size : {std::size_t{8}, at - 20, at + 2, at + 8}) {
    scratch.write("cut.exr", small.substr(0, size));
    EXPECT_TRUE(has(refusal(scratch / "cut.exr"), "no picture that can be read")) << size;
  }
  EXPECT_LT(peak() - before, 100e6) << "bytes touched";
}

TEST(DamagedPicture, WhatIsWholeIsReadWhateverPacksIt) {
  const Scratch scratch;
  for (const char* compression : {"none", "rle", "zip", "zips", "piz"})
    for (const int tile : {0, 16, 64}) {
      write_exr(scratch / "a.exr", 300, 530, compression, tile);
      const Image image = read_image(scratch / "a.exr");
      ASSERT_EQ(image.rgba.size(), std::size_t{4} * 300 * 530);
      for (std::size_t i = 0; i < image.rgba.size(); ++i)
        ASSERT_EQ(image.rgba[i], static_cast<float>(i % 251)) << compression << ' ' << tile << ' ' << i;
    }
  write_image(scratch / "black.exr", grey(4096, 1024, 0), {}, {});  // packs a thousandfold
  EXPECT_EQ(read_image(scratch / "black.exr").width, 4096U);
}

TEST(DamagedPicture, NegativeStandardErrorsAreRefused) {
  const Scratch scratch;
  Image image = grey(4, 4, 1);
  image.standard_error.assign(48, 0.25F);
  write_image(scratch / "a.exr", image, {}, {});
  EXPECT_EQ(read_image(scratch / "a.exr").standard_error, image.standard_error);
  image.standard_error[17] = -1e-9F;
  write_image(scratch / "b.exr", image, {}, {});
  EXPECT_TRUE(has(refusal(scratch / "b.exr"), "negative standard error"));
}

TEST(DamagedPicture, PackedOrMissingPicturesSayHowToGetThem) {
  const Scratch scratch;
  scratch.write("a.exr", "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n");
  EXPECT_TRUE(has(refusal(scratch / "a.exr"), "git lfs pull"));
  scratch.write("b.exr", "\x1f\x8b\x08 and so on");
  EXPECT_TRUE(has(refusal(scratch / "b.exr"), "gunzip"));
}

std::string state_refusal(const Image& image, std::uint32_t batches, std::uint32_t samples) {
  try {
    (void)reference_state(image, batches, samples);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    return error.what();
  }
  return "";
}

TEST(DamagedPicture, AResumedReferenceCanOnlyClaimWhatCanBe) {
  Image whole = grey(3, 2, 0.5F);
  whole.standard_error.assign(18, 0.01F);
  EXPECT_EQ(state_refusal(whole, 2, 1), "");
  EXPECT_EQ(state_refusal(whole, 1000000, 8), "");
  for (const std::uint32_t batches : {0U, 1U, 2000000000U, 0xffffffffU})
    EXPECT_NE(state_refusal(whole, batches, 8), "");
  for (const std::uint32_t samples : {0U, 1000000U, 0xffffffffU}) EXPECT_NE(state_refusal(whole, 16, samples), "");
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (const float bad : {nan, inf, -inf}) {
    for (const std::size_t i : {0U, 6U, 23U}) {
      Image image = whole;
      image.rgba[i] = bad;
      EXPECT_NE(state_refusal(image, 16, 8), "") << bad << " at " << i;
    }
    Image image = whole;
    image.standard_error[17] = bad;
    EXPECT_NE(state_refusal(image, 16, 8), "") << bad;
  }
  for (const float alpha : {-0.1F, 1.1F}) {
    Image image = whole;
    image.rgba[7] = alpha;
    EXPECT_NE(state_refusal(image, 16, 8), "") << alpha;
  }
  Image negative = whole;
  negative.standard_error[3] = -0.1F;
  EXPECT_NE(state_refusal(negative, 16, 8), "");
  Image other_size = whole;
  other_size.height = 3;
  EXPECT_NE(state_refusal(other_size, 16, 8), "");
}

}  // namespace
}  // namespace parian
