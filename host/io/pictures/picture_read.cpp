// Reading linear pictures back with OpenImageIO.
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "error.hpp"
#include "pictures.hpp"

namespace parian::pictures {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& path, std::string what, const char* remedy) {
  while (!what.empty() && (what.back() == '\n' || what.back() == ' ')) what.pop_back();
  std::replace(what.begin(), what.end(), '\n', ' ');
  throw Error(ErrorKind::input, fmt::format("{}: {}; {}", path.string(), what, remedy));
}

std::unique_ptr<OIIO::ImageInput> open(const std::filesystem::path& path) {
  std::error_code failed;
  if (!std::filesystem::exists(path, failed)) refuse(path, "there is no such file", "check the name");
  if (!std::filesystem::is_regular_file(path, failed)) refuse(path, "is not a file", "give a picture");
  auto input = OIIO::ImageInput::open(path.string());
  const std::string why = OIIO::geterror();
  if (!input) refuse(path, "is no picture that can be read (" + why + ")", "give an EXR file");
  return input;
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
  if (spec.width < 1 || spec.height < 1 || spec.depth != 1) refuse(path, "is not a flat picture", "give a picture");
  const std::array<int, 3> errors{channel(spec, "stderr.R"), channel(spec, "stderr.G"), channel(spec, "stderr.B")};
  Image image;
  image.width = static_cast<std::uint32_t>(spec.width);
  image.height = static_cast<std::uint32_t>(spec.height);
  const std::size_t pixels = std::size_t{image.width} * image.height, channels = spec.nchannels;
  std::vector<float> values;
  try {
    values.resize(pixels * channels);
  } catch (const std::exception&) {  // a damaged header asks for more than there is
    refuse(path, fmt::format("{}x{} pixels don't fit in memory", spec.width, spec.height), "make it again");
  }
  if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeFloat, values.data())) {
    refuse(path, "can't be read in full (" + input->geterror() + ")", "make it again");
  }
  image.estimated_relmse = spec.get_float_attribute("parian:estimated_relmse", -1.0F);
  image.rgba.reserve(4 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const float* pixel = &values[i * channels];
    for (int c = 0; c < 4; ++c) image.rgba.push_back(rgba[c] < 0 ? 1.0F : pixel[rgba[c]]);
    if (std::min({errors[0], errors[1], errors[2]}) < 0) continue;
    for (const int c : errors) image.standard_error.push_back(pixel[c]);
  }
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
