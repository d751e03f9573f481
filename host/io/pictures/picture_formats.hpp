// The formats that pictures are written in, and reading back what was written.
#pragma once
#include <OpenImageIO/imageio.h>

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace parian::pictures {

/// How well a format keeps its values.
enum class Keeps {
  exactly,
  to_eight_bits,  ///< three floats that are not negative, under a common exponent
  roughly,        ///< lossy
};

/// A format that can be trusted: its writer fails without a word on standard error, and its files show if they are
/// whole.
struct Format {
  std::string_view name;  ///< OpenImageIO's
  bool floats;            ///< else bytes
  Keeps keeps;
  std::uint32_t least_side = 1, largest_side = 65500;  ///< pixels
};

/// The format that a writer has, or null: what isn't known isn't written.
[[nodiscard]] const Format* format_of(const OIIO::ImageOutput& output);

/// Whether `file` is a picture of `spec` that has `values`, floats or bytes as the format has them, in all its pixels.
[[nodiscard]] bool holds(const std::filesystem::path& file, const Format& format, const OIIO::ImageSpec& spec,
                         const void* values);

}  // namespace parian::pictures
