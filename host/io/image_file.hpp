// Pictures in files, through OpenImageIO: linear floats where a format holds them, sRGB bytes elsewhere.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "io/render_options.hpp"
#include "scene/scene.hpp"

namespace parian {

/// How bright formats of bytes come out: 2^stops times the radiance. Formats of floats hold the radiance itself.
struct Exposure {
  bool automatic = false;  ///< stops from the picture: the 99th percentile of luminance at 0.8
  double stops = 0.0;
};

/// "auto" or a number of stops; empty when it's neither.
[[nodiscard]] std::optional<Exposure> parse_exposure(const OptionValue& value);

/// The stops that put the 99th percentile of luminance, over pixels with alpha > 0 and with alpha divided out, at 0.8;
/// 0 when nothing is bright.
[[nodiscard]] double automatic_stops(const Image& image);

/// What a picture's metadata says; nothing of when and where it was made, so that equal runs give equal files.
struct PictureNotes {
  std::string device;  ///< left out if empty
  std::string settings;
  std::uint32_t frames = 0;                    ///< left out if 0
  double estimated_relmse = -1.0;              ///< negative: not known
  std::map<std::string, std::string> other{};  ///< more of them, by name without the leading "parian:"
};

/// Throws Error(output) when write_image would fail for sure: unknown extension, no such folder, or a film (if it is
/// known: above 0) that the format can't have.
void check_output(const std::filesystem::path& path, glm::uvec2 film = {0, 0});

/// A PNG as write_image writes it, without notes, in base64 with padding. Throws Error(output).
[[nodiscard]] std::string png_base64(const Image& image, double stops);

/// Writes a linear premultiplied image as the extension says, whole or not at all: it is read back before it takes its
/// place. Throws Error(output).
/// `.exr` and other formats of floats: linear, premultiplied, and in `.exr` channels stderr.R, .G and .B if the
/// standard error is known. Formats of bytes: sRGB curve of 2^stops times the radiance, clipped, alpha unassociated.
/// Formats without alpha: RGB over black.
void write_image(const std::filesystem::path& path, const Image& image, const PictureNotes& notes,
                 const Exposure& exposure);

/// Reads a linear picture of floats: RGBA, or RGB, which counts as opaque; with its standard error where the file has
/// it. Throws Error(input) naming the file when it's missing, damaged, or holds bytes instead of radiance.
[[nodiscard]] Image read_image(const std::filesystem::path& path);

/// What a picture's metadata says under names that begin with "parian:", which the keys leave out, as text. Throws
/// Error(input) when the file is missing or damaged.
[[nodiscard]] std::map<std::string, std::string> read_notes(const std::filesystem::path& path);

}  // namespace parian
