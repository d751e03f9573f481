// Picture files: values, alpha, metadata, equal bytes, and nothing half written.
#include "io/image_file.hpp"

#include <OpenImageIO/imageio.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <set>
#include <sstream>

#include "core/error.hpp"
#include "scratch.hpp"

namespace parian {
namespace {

using test::read_bytes;
using test::Scratch;

struct Picture {
  OIIO::ImageSpec spec;
  std::vector<float> values;
};

/// A picture as it's stored, as floats; bytes become value/255.
Picture read(const std::filesystem::path& path) {
  OIIO::ImageSpec as_stored;
  as_stored.attribute("oiio:UnassociatedAlpha", 1);  // don't premultiply
  const auto input = OIIO::ImageInput::open(path.string(), &as_stored);
  EXPECT_TRUE(input) << path;
  if (!input) return {};
  Picture picture{input->spec(), {}};
  picture.values.resize(picture.spec.image_pixels() * picture.spec.nchannels);
  EXPECT_TRUE(input->read_image(0, 0, 0, picture.spec.nchannels, OIIO::TypeFloat, picture.values.data()));
  return picture;
}

/// 2 x 2: opaque, half covered, empty, over-bright.
Image small_image() {
  return {2, 2, {0.5f, 0.25f, 0.125f, 1, 0.25f, 0.125f, 0.0625f, 0.5f, 0, 0, 0, 0, 8, 0.001f, 0, 1}};
}

Image large_image() {
  Image image{256, 256, {}};
  std::uint32_t state = 1;
  for (std::size_t i = 0; i < std::size_t{4} * 256 * 256; ++i) {
    state = state * 1664525u + 1013904223u;  // noise, so that it doesn't compress
    image.rgba.push_back(i % 4 == 3 ? 1.0f : static_cast<float>(state >> 8) / 16777216.0f);
  }
  return image;
}

const PictureNotes notes{"a device", "samples=16", 12, 0.5};

double srgb(double x) { return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055; }

ErrorKind refusal(const std::filesystem::path& path) {
  try {
    check_output(path);
  } catch (const Error& error) {
    return error.kind();
  }
  return static_cast<ErrorKind>(0);
}

TEST(ImageTest, ExrHoldsTheValues) {
  const Scratch scratch;
  for (const char* name : {"a.exr", "a.EXR", "a.tif"}) {
    write_image(scratch / name, small_image(), notes, {false, 3.0});  // exposure must not matter
    const Picture picture = read(scratch / name);
    EXPECT_EQ(picture.spec.format, OIIO::TypeFloat);
    EXPECT_EQ(picture.values, small_image().rgba) << name;
  }
}

TEST(ImageTest, ExrSaysWhatItIs) {
  const Scratch scratch;
  unsetenv("SOURCE_DATE_EPOCH");
  write_image(scratch / "a.exr", small_image(), notes, {});
  const OIIO::ImageSpec spec = read(scratch / "a.exr").spec;
  EXPECT_TRUE(std::string(spec.get_string_attribute("Software")).starts_with("parian "));
  EXPECT_EQ(spec.get_string_attribute("DateTime"), "1970:01:01 00:00:00");
  EXPECT_EQ(spec.get_string_attribute("parian:device"), "a device");
  EXPECT_EQ(spec.get_string_attribute("parian:settings"), "samples=16");
  EXPECT_EQ(spec.get_string_attribute("parian:frames"), "12");
  EXPECT_EQ(spec.get_float_attribute("parian:estimated_relmse"), 0.5f);
  EXPECT_EQ(spec.get_string_attribute("compression"), "zip");
  EXPECT_FALSE(spec.find_attribute("HostComputer"));
  setenv("SOURCE_DATE_EPOCH", "86399", 1);
  write_image(scratch / "b.exr", small_image(), notes, {});
  unsetenv("SOURCE_DATE_EPOCH");
  EXPECT_EQ(read(scratch / "b.exr").spec.get_string_attribute("DateTime"), "1970:01:01 23:59:59");
}

TEST(ImageTest, ReadsBackWhatWasWritten) {
  const Scratch scratch;
  Image image = small_image();
  PictureNotes more = notes;
  more.other = {{"batches", "17"}};
  write_image(scratch / "a.exr", image, more, {});
  EXPECT_EQ(read_image(scratch / "a.exr").rgba, image.rgba);
  EXPECT_TRUE(read_image(scratch / "a.exr").standard_error.empty());
  EXPECT_EQ(read_image(scratch / "a.exr").estimated_relmse, 0.5);
  EXPECT_EQ(read_notes(scratch / "a.exr").at("batches"), "17");
  for (int i = 0; i < 12; ++i) image.standard_error.push_back(0.25f * static_cast<float>(i));
  write_image(scratch / "b.exr", image, notes, {});
  const Image back = read_image(scratch / "b.exr");
  EXPECT_EQ(back.rgba, image.rgba);
  EXPECT_EQ(back.standard_error, image.standard_error);
  const std::vector<std::string> names = read(scratch / "b.exr").spec.channelnames;
  EXPECT_EQ(names, (std::vector<std::string>{"R", "G", "B", "A", "stderr.R", "stderr.G", "stderr.B"}));
  write_image(scratch / "b.tif", image, notes, {});  // keeps the picture alone
  EXPECT_EQ(read_image(scratch / "b.tif").rgba, image.rgba);
  write_image(scratch / "b.png", image, notes, {});
  EXPECT_FALSE(read_bytes(scratch / "b.png").empty());
}

TEST(ImageTest, RefusesToReadWhatHoldsNoRadiance) {
  const Scratch scratch;
  const auto refusal_to_read = [&](const std::string& name) {
    try {
      (void)read_image(scratch / name);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input);
      EXPECT_EQ(std::string(error.what()).find((scratch / name).string()), 0u) << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  EXPECT_NE(refusal_to_read("none.exr").find("no such file"), std::string::npos);
  write_image(scratch / "a.png", small_image(), notes, {});
  EXPECT_NE(refusal_to_read("a.png").find("not radiance"), std::string::npos);
  scratch.write("text.exr", "no picture at all");
  EXPECT_NE(refusal_to_read("text.exr").find("no picture that can be read"), std::string::npos);
  write_image(scratch / "whole.exr", large_image(), notes, {});
  const std::string whole = read_bytes(scratch / "whole.exr");
  for (const std::size_t size : {std::size_t{3}, std::size_t{100}, whole.size() / 2, whole.size() - 10}) {
    scratch.write("part.exr", whole.substr(0, size));
    EXPECT_NE(refusal_to_read("part.exr"), "nothing") << size << " of " << whole.size() << " bytes";
  }
}

TEST(ImageTest, EqualRunsGiveEqualBytes) {
  const Scratch scratch;
  for (const char* extension : {".exr", ".png", ".tif", ".jpg", ".hdr"}) {
    const auto a = scratch / (std::string("a") + extension), b = scratch / (std::string("b") + extension);
    write_image(a, small_image(), notes, {});
    write_image(b, small_image(), notes, {});
    EXPECT_FALSE(read_bytes(a).empty()) << extension;
    EXPECT_EQ(read_bytes(a), read_bytes(b)) << extension;
  }
}

TEST(ImageTest, PngIsToneMappedWithUnassociatedAlpha) {
  const Scratch scratch;
  write_image(scratch / "a.png", small_image(), notes, {false, 1.0});
  const Picture picture = read(scratch / "a.png");
  ASSERT_EQ(picture.spec.nchannels, 4);
  EXPECT_EQ(picture.spec.format, OIIO::TypeUInt8);
  const std::vector<double> expected{1, srgb(0.5), srgb(0.25), 1, 1, srgb(0.5),   srgb(0.25), 0.5,
                                     0, 0,         0,          0, 1, srgb(0.002), 0,          1};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(picture.values[i], expected[i], 0.502 / 255) << "value " << i;  // rounded to the nearest of 256
  }
}

TEST(ImageTest, FormatsWithoutAlphaAreOverBlack) {
  const Scratch scratch;
  write_image(scratch / "a.hdr", small_image(), notes, {});
  const Picture picture = read(scratch / "a.hdr");
  ASSERT_EQ(picture.spec.nchannels, 3);
  EXPECT_NEAR(picture.values[3], 0.25, 0.25 / 128);  // RGBE keeps 8 bits
  write_image(scratch / "a.jpg", small_image(), notes, {});
  EXPECT_EQ(read(scratch / "a.jpg").spec.nchannels, 3);
}

TEST(ImageTest, AutomaticExposurePutsThePercentileInPlace) {
  Image image{100, 1, {}};
  for (int i = 1; i <= 100; ++i) {
    const float v = static_cast<float>(i) * 0.5f;  // half covered: radiance is i
    image.rgba.insert(image.rgba.end(), {v, v, v, 0.5f});
  }
  EXPECT_NEAR(automatic_stops(image), std::log2(0.8 / 99), 1e-6);
  EXPECT_EQ(automatic_stops(Image{1, 1, {0, 0, 0, 0}}), 0.0);
  EXPECT_EQ(automatic_stops(Image{1, 1, {0, 0, 0, 1}}), 0.0);
  EXPECT_EQ(automatic_stops(Image{1, 1, {NAN, 0, 0, 1}}), 0.0);
  const Scratch scratch;
  write_image(scratch / "a.png", image, notes, {true, 0.0});
  const Picture picture = read(scratch / "a.png");
  EXPECT_NEAR(picture.values[98 * 4], srgb(0.8), 0.502 / 255);
  EXPECT_NEAR(std::stof(std::string(picture.spec.get_string_attribute("parian:exposure", "nan"))), std::log2(0.8 / 99),
              1e-4);
}

TEST(ImageTest, NonfiniteValuesBecomeBytes) {
  const Scratch scratch;
  write_image(scratch / "a.png", {2, 1, {NAN, INFINITY, -INFINITY, 1, 1, 1, 1, NAN}}, notes, {});
  const Picture picture = read(scratch / "a.png");
  EXPECT_EQ(std::vector<float>(picture.values.begin(), picture.values.begin() + 4), (std::vector<float>{0, 1, 0, 1}));
}

TEST(ImageTest, RefusesBeforeWriting) {
  const Scratch scratch;
  for (const char* name : {"a.exr", "a.png", "a.tif", "a.jpg", "a.hdr", "with space.exr"}) {
    EXPECT_EQ(refusal(scratch / name), static_cast<ErrorKind>(0)) << name;
  }
  std::filesystem::create_directory(scratch / "folder.exr");
  for (const char* name : {"a", "a.", "a.xyz", "a.null", "none/a.exr", "folder.exr", ".exr"}) {
    EXPECT_EQ(refusal(scratch / name), ErrorKind::output) << name;
  }
  EXPECT_EQ(refusal("/dev/full"), ErrorKind::output);
  std::filesystem::create_symlink("/dev/full", scratch / "full.exr");
  EXPECT_EQ(refusal(scratch / "full.exr"), ErrorKind::output);
  EXPECT_EQ(refusal(""), ErrorKind::output);
}

/// Lets files grow to `bytes` only, as on a disk that is nearly full.
class SmallDisk {
 public:
  explicit SmallDisk(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~SmallDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, SIG_DFL);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

 private:
  rlimit before_{};
};

/// Every extension that OpenImageIO knows, or the first of each format.
std::vector<std::string> extensions(bool first_only = false) {
  std::vector<std::string> all;
  std::istringstream formats(OIIO::get_string_attribute("extension_list"));
  for (std::string format; std::getline(formats, format, ';');) {  // "tiff:tif,tiff,tx"
    std::istringstream names(format.substr(format.find(':') + 1));
    for (std::string name; std::getline(names, name, ',');) {
      all.push_back(name);
      if (first_only) break;
    }
  }
  return all;
}

double mean_difference(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
  return sum / static_cast<double>(a.size());
}

TEST(ImageTest, EveryFormatIsWrittenWholeOrRefused) {
  const Image image = large_image();
  std::set<std::string> written;
  for (const std::string& extension : extensions()) {
    const Scratch scratch;
    const auto file = scratch / ("a." + extension);
    if (refusal(file) == ErrorKind::output) {
      EXPECT_THROW(write_image(file, image, notes, {}), Error) << extension;
      EXPECT_TRUE(std::filesystem::is_empty(scratch.folder())) << extension;
      continue;
    }
    written.insert(extension);
    ASSERT_NO_THROW(write_image(file, image, notes, {})) << extension;
    const Picture picture = read(file);
    ASSERT_EQ(picture.spec.width, 256) << extension;
    ASSERT_EQ(picture.spec.height, 256) << extension;
    std::vector<float> expected;
    for (std::size_t i = 0; i < image.rgba.size(); ++i)
      if (i % 4 < static_cast<std::size_t>(picture.spec.nchannels))
        expected.push_back(picture.spec.format == OIIO::TypeFloat ? image.rgba[i]
                           : i % 4 == 3                           ? 1.0F
                                                                  : static_cast<float>(srgb(image.rgba[i])));
    ASSERT_EQ(picture.values.size(), expected.size()) << extension;
    // Noise is what lossy formats keep worst; two pictures of it without a pixel in common differ by a third.
    const double most = picture.spec.format == OIIO::TypeFloat ? 0.004 : 0.2,
                 found = mean_difference(picture.values, expected);
    fmt::print("{:<5} {} channels, off by {:.2g} in the mean\n", extension, picture.spec.nchannels, found);
    EXPECT_LE(found, most) << extension;
  }
  for (const char* extension : {"exr", "png", "tif", "jpg", "hdr", "bmp", "tga", "fits", "jp2", "webp"})
    EXPECT_TRUE(written.contains(extension)) << extension;
}

TEST(ImageTest, FullDiskKeepsTheOldFile) {
  const Image image = large_image();
  for (const std::string& extension : extensions(true)) {
    const Scratch scratch;
    const auto file = scratch / ("a." + extension);
    if (refusal(file) == ErrorKind::output) continue;
    write_image(file, image, notes, {});
    const rlim_t whole = std::filesystem::file_size(file);
    scratch.write("a." + extension, "old");
    for (const rlim_t bytes : {rlim_t{0}, rlim_t{77}, rlim_t{1000}, rlim_t{16384}, whole / 2, whole - 1}) {
      const SmallDisk disk(bytes);
      EXPECT_THROW(write_image(file, image, notes, {}), Error) << extension << ' ' << bytes << " of " << whole;
    }
    EXPECT_TRUE(read_bytes(file) == "old") << extension;
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(scratch.folder()), {}), 1) << "left something behind";
  }
}

TEST(ImageTest, FilmsThatAFormatCannotHoldAreRefusedFirst) {
  const Scratch scratch;
  EXPECT_NO_THROW(check_output(scratch / "a.jp2", {32, 32}));
  EXPECT_THROW(check_output(scratch / "a.jp2", {31, 400}), Error);
  EXPECT_NO_THROW(check_output(scratch / "a.webp", {16383, 1}));
  EXPECT_THROW(check_output(scratch / "a.webp", {1, 16384}), Error);
  EXPECT_NO_THROW(check_output(scratch / "a.exr", {16384, 16384}));
}

TEST(ImageTest, ReplacesAFileAndKeepsALink) {
  const Scratch scratch;
  scratch.write("real.png", "old");
  std::filesystem::create_symlink("real.png", scratch / "link.png");
  write_image(scratch / "link.png", small_image(), notes, {});
  EXPECT_TRUE(std::filesystem::is_symlink(scratch / "link.png"));
  EXPECT_EQ(read(scratch / "real.png").spec.width, 2);
}

}  // namespace
}  // namespace parian
