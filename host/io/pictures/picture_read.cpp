// Reading linear pictures back with OpenImageIO.
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/error.hpp"
#include "io/foreign_file.hpp"
#include "io/pictures/exr_header.hpp"
#include "io/pictures/pictures.hpp"
#include "scene/limits.hpp"

namespace parian::pictures {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& message) {
  throw Error(ErrorKind::input, fmt::format("{}: {}", path.string(), message));
}

[[noreturn]] void refuse(const std::filesystem::path& path, std::string what, const char* remedy) {
  while (!what.empty() && (what.back() == '\n' || what.back() == ' ')) what.pop_back();
  std::replace(what.begin(), what.end(), '\n', ' ');
  refuse(path, fmt::format("{}; {}", what, remedy));
}

/// Bytes of pixels that a picture may always promise: less hurts nobody, and even an all-black one needs its chunks.
constexpr double harmless = 64e6;
/// Times as many bytes as deflate, the best of what packs pictures of floats, can have packed into one.
constexpr double best_packing = 1032;
constexpr int rows_at_once = 256;  // at least; EXR's tallest chunks

/// Refuses a picture whose header promises more than there can be, before anything is allocated for it.
void check_promise(const OIIO::ImageSpec& spec, const std::filesystem::path& path) {
  constexpr auto largest = static_cast<int>(largest_film_side);
  if (spec.width < 1 || spec.height < 1 || spec.depth != 1 || spec.deep)
    refuse(path, "is not a flat picture", "give a picture");
  if (spec.width > largest || spec.height > largest)
    refuse(path, fmt::format("has {}x{} pixels, more than {} along a side", spec.width, spec.height, largest),
           "give a smaller picture");
  constexpr int farthest = 1 << 30;  // from the origin, so that sums of places stay integers
  if (std::max({spec.x, spec.y, spec.tile_width, spec.tile_height}) > farthest || std::min(spec.x, spec.y) < -farthest)
    refuse(path, "has its pixels too far away from the origin", "it is damaged; make it again");
  std::error_code failed;
  const auto size = static_cast<double>(std::filesystem::file_size(path, failed));
  const auto promised = static_cast<double>(std::max(spec.image_bytes(true), spec.tile_bytes(true)));
  if (promised > harmless && !(promised <= best_packing * size))
    refuse(path,
           fmt::format("promises {}x{} pixels of {} channels, which don't fit into its {:.0f} bytes", spec.width,
                       spec.height, spec.nchannels, size),
           "it is damaged; make it again");
}

std::unique_ptr<OIIO::ImageInput> open(const std::filesystem::path& path) {
  std::error_code failed;
  if (!std::filesystem::exists(path, failed)) refuse(path, "there is no such file", "check the name");
  if (!std::filesystem::is_regular_file(path, failed)) refuse(path, "is not a file", "give a picture");
  if (const std::string fault = exr_header_fault(path); !fault.empty())
    refuse(path, "is no picture that can be read (" + fault + ")", "make it again");
  // The reader that the name asks for and no other: those of formats without a magic number take anything for a
  // picture, and allocate what it seems to promise.
  OIIO::attribute("try_all_readers", 0);
  auto input = OIIO::ImageInput::open(path.string());
  OIIO::attribute("try_all_readers", 1);  // for whoever reads pictures back that have been written
  const std::string why = OIIO::geterror();
  if (!input) {
    if (const std::string kind = foreign_file(path); !kind.empty()) refuse(path, kind);
    refuse(path, "is no picture that can be read (" + why + ")", "give an EXR file");
  }
  check_promise(input->spec(), path);
  return input;
}

/// Reads rows `begin` to `end`, counted from the first, all channels of them.
bool read_rows(OIIO::ImageInput& input, int begin, int end, std::vector<float>& values) {
  const OIIO::ImageSpec& spec = input.spec();
  const int first = spec.y + begin, last = spec.y + end;
  if (spec.tile_width == 0)
    return input.read_scanlines(0, 0, first, last, spec.z, 0, spec.nchannels, OIIO::TypeFloat, values.data());
  return input.read_tiles(0, 0, spec.x, spec.x + spec.width, first, last, spec.z, spec.z + 1, 0, spec.nchannels,
                          OIIO::TypeFloat, values.data());
}

int channel(const OIIO::ImageSpec& spec, const std::string& name) {
  const auto at = std::find(spec.channelnames.begin(), spec.channelnames.end(), name);
  return at == spec.channelnames.end() ? -1 : static_cast<int>(at - spec.channelnames.begin());
}

}  // namespace

Image read(const std::filesystem::path& path) {
  const auto input = open(path);
  const OIIO::ImageSpec& spec = input->spec();
  if (!spec.format.is_floating_point()) {
    refuse(path, "holds bytes of a tone-mapped picture, not radiance", "give a picture of floats, such as an EXR");
  }
  const std::array<int, 4> rgba{channel(spec, "R"), channel(spec, "G"), channel(spec, "B"), channel(spec, "A")};
  if (std::min({rgba[0], rgba[1], rgba[2]}) < 0) {
    refuse(path, "has no channels R, G and B", "give a colour picture");
  }
  const std::array<int, 3> errors{channel(spec, "stderr.R"), channel(spec, "stderr.G"), channel(spec, "stderr.B")};
  const bool has_errors = std::min({errors[0], errors[1], errors[2]}) >= 0;
  Image image;
  image.width = static_cast<std::uint32_t>(spec.width);
  image.height = static_cast<std::uint32_t>(spec.height);
  image.estimated_relmse = spec.get_float_attribute("parian:estimated_relmse", -1.0F);
  const std::size_t channels = spec.nchannels;
  const std::size_t pixels = std::size_t{image.width} * image.height;
  std::vector<float> values;
  try {  // untouched yet
    image.rgba.reserve(4 * pixels);
    if (has_errors) image.standard_error.reserve(3 * pixels);
  } catch (const std::exception&) {
    refuse(path, fmt::format("{}x{} pixels don't fit in memory", spec.width, spec.height), "give a smaller picture");
  }
  // Some rows at a time, so that a damaged file takes no more memory than it has pixels.
  const int step = std::max(spec.tile_height, 1) * ((rows_at_once - 1) / std::max(spec.tile_height, 1) + 1);
  for (int row = 0; row < spec.height; row += step) {
    const int end = std::min(row + step, spec.height);
    values.resize(channels * image.width * static_cast<std::size_t>(end - row));
    if (!read_rows(*input, row, end, values))
      refuse(path, "can't be read in full (" + input->geterror() + ")", "make it again");
    for (std::size_t i = 0; i < values.size(); i += channels) {
      const float* pixel = &values[i];
      for (int c = 0; c < 4; ++c) image.rgba.push_back(rgba[c] < 0 ? 1.0F : pixel[rgba[c]]);
      if (!has_errors) continue;
      for (const int c : errors) image.standard_error.push_back(pixel[c]);
    }
  }
  // NaN and infinity are left to whoever compares.
  for (const float error : image.standard_error)
    if (error < 0.0F) refuse(path, "has a negative standard error", "make it again");
  return image;
}

std::map<std::string, std::string> read_notes(const std::filesystem::path& path) {
  constexpr std::string_view prefix = "parian:";
  std::map<std::string, std::string> notes;
  const auto input = open(path);
  for (const OIIO::ParamValue& value : input->spec().extra_attribs) {
    const std::string name = value.name().string();
    if (name.starts_with(prefix)) notes[name.substr(prefix.size())] = value.get_string();
  }
  return notes;
}

}  // namespace parian::pictures
