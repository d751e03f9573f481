// What each format keeps, and comparing rows with what they should be.
#include "io/pictures/picture_formats.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

namespace parian::pictures {
namespace {

// Left out: iff, whose writer may divide by zero, ico, whose library prints, heif and zfile, whose files can't be
// judged.
constexpr std::array<Format, 15> formats{{
    {"openexr", true, Keeps::exactly},
    {"tiff", true, Keeps::exactly},
    {"rla", true, Keeps::exactly},
    {"fits", true, Keeps::exactly},
    {"hdr", true, Keeps::to_eight_bits},
    {"png", false, Keeps::exactly},
    {"bmp", false, Keeps::exactly},
    {"targa", false, Keeps::exactly},
    {"sgi", false, Keeps::exactly},
    {"pnm", false, Keeps::exactly},
    {"dpx", false, Keeps::exactly},
    {"jpeg2000", false, Keeps::exactly, 32},
    {"gif", false, Keeps::roughly},
    {"jpeg", false, Keeps::roughly},
    {"webp", false, Keeps::roughly, 1, 16383},
}};

/// A writer of eight bits may round either way; exponents below the smallest float's lose more.
bool near_in_eight_bits(const float* a, const float* b) {
  const float largest = std::max({a[0], a[1], a[2]});
  if (!std::isfinite(a[0] + a[1] + a[2]) || std::min({a[0], a[1], a[2]}) < 0) return true;  // not in the format
  for (int c = 0; c < 3; ++c)
    if (!(std::abs(a[c] - b[c]) <= largest / 64 + 1e-30F)) return false;
  return true;
}

bool near_enough(const Format& format, std::size_t values, const void* wanted, const void* got) {
  if (format.keeps == Keeps::exactly)
    return std::memcmp(wanted, got, values * (format.floats ? sizeof(float) : 1)) == 0;
  const auto *a = static_cast<const float*>(wanted), *b = static_cast<const float*>(got);
  for (std::size_t i = 0; i < values; i += 3)
    if (!near_in_eight_bits(a + i, b + i)) return false;
  return true;
}

/// Whether bytes are a compressed form of others: off by less than noise is from noise, in the mean over pixels. Alpha
/// that is 1 all over may be left out.
bool roughly_the_same(std::size_t pixels, const std::uint8_t* wanted, int wanted_channels, const std::uint8_t* got,
                      int got_channels) {
  constexpr int largest_loss = 64;
  double sum = 0;
  for (std::size_t i = 0; i < pixels; ++i)
    for (int c = 0; c < wanted_channels; ++c) {
      const int value = c < got_channels ? got[i * got_channels + c] : 255;
      sum += std::abs(wanted[i * wanted_channels + c] - value);
    }
  return sum <= largest_loss * static_cast<double>(pixels) * wanted_channels;
}

}  // namespace

const Format* format_of(const OIIO::ImageOutput& output) {
  const auto* found = std::find_if(formats.begin(), formats.end(),
                                   [&](const Format& format) { return format.name == output.format_name(); });
  return found == formats.end() ? nullptr : found;
}

bool holds(const std::filesystem::path& file, const Format& format, const OIIO::ImageSpec& spec, const void* values) {
  constexpr int rows = 64;  // at once
  OIIO::ImageSpec as_stored;
  as_stored.attribute("oiio:UnassociatedAlpha", 1);  // not multiplied by alpha
  const auto input = OIIO::ImageInput::open(file.string(), &as_stored);
  (void)OIIO::geterror();  // OpenImageIO keeps the message until it's asked for
  if (!input) return false;
  const OIIO::ImageSpec& found = input->spec();
  if (found.width != spec.width || found.height != spec.height) return false;
  const bool rough = format.keeps == Keeps::roughly;
  if (found.nchannels != spec.nchannels && !(rough && found.nchannels == 3)) return false;
  const OIIO::TypeDesc type = format.floats ? OIIO::TypeFloat : OIIO::TypeUInt8;
  const std::size_t row = static_cast<std::size_t>(spec.width) * spec.nchannels * type.size();
  std::vector<std::uint8_t> got(row * static_cast<std::size_t>(std::min(rows, spec.height)));
  for (int y = 0; y < spec.height; y += rows) {
    const int end = std::min(y + rows, spec.height);
    const bool read = input->read_scanlines(0, 0, found.y + y, found.y + end, 0, 0, found.nchannels, type, got.data());
    (void)input->geterror();
    const auto* wanted = static_cast<const std::uint8_t*>(values) + row * static_cast<std::size_t>(y);
    const std::size_t pixels = static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(end - y);
    if (!read) return false;
    if (rough ? !roughly_the_same(pixels, wanted, spec.nchannels, got.data(), found.nchannels)
              : !near_enough(format, pixels * spec.nchannels, wanted, got.data()))
      return false;
  }
  return true;
}

}  // namespace parian::pictures
