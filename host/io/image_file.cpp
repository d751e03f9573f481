// Pictures without OpenImageIO, and the module that has it, loaded when it's needed first.
#include "io/image_file.hpp"

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "io/module.hpp"
#include "io/pictures/pictures.hpp"
#include "io/whole_file.hpp"
#include "scene/limits.hpp"

namespace parian {
namespace {

constexpr double bright = 0.8;         // where `auto` puts the percentile
constexpr double bright_share = 0.99;  // which percentile

const pictures::Functions& picture_functions() {
  static const auto* functions = static_cast<const pictures::Functions*>(
      module_symbol(PARIAN_PICTURES, "parian_pictures", ErrorKind::output, "pictures can't be read or written"));
  return *functions;
}

}  // namespace

std::optional<Exposure> parse_exposure(const OptionValue& value) {
  const std::string* text = std::get_if<std::string>(&value);
  const double* number = std::get_if<double>(&value);
  if (text && *text == "auto") return Exposure{true, 0.0};
  const auto stops = text ? parse_number(*text) : number ? std::optional(*number) : std::nullopt;
  if (!stops || std::abs(*stops) > largest_stops) return std::nullopt;
  return Exposure{false, *stops};
}

double automatic_stops(const Image& image) {
  std::vector<float> luminance;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    const float* p = &image.rgba[i];
    const float y = (0.2126f * p[0] + 0.7152f * p[1] + 0.0722f * p[2]) / p[3];
    if (p[3] > 0 && std::isfinite(y)) luminance.push_back(y);
  }
  if (luminance.empty()) return 0;
  const auto rank = static_cast<std::ptrdiff_t>(std::ceil(bright_share * static_cast<double>(luminance.size()))) - 1;
  std::nth_element(luminance.begin(), luminance.begin() + rank, luminance.end());
  const double percentile = luminance[static_cast<std::size_t>(rank)];
  if (!(percentile > 0)) return 0;
  return std::clamp(std::log2(bright / percentile), -largest_stops, largest_stops);
}

void check_output(const std::filesystem::path& path, glm::uvec2 film) {
  const std::string extension = path.extension().string();
  if (extension != ".exr" && extension != ".png") picture_functions().check_format(path, film);
  check_place(path);
}

std::string png_base64(const Image& image, double stops) { return picture_functions().png_base64(image, stops); }

void write_image(const std::filesystem::path& path, const Image& image, const PictureNotes& notes,
                 const Exposure& exposure) {
  check_output(path, {image.width, image.height});
  picture_functions().write(path, image, notes, exposure);
}

Image read_image(const std::filesystem::path& path) { return picture_functions().read(path); }

std::map<std::string, std::string> read_notes(const std::filesystem::path& path) {
  return picture_functions().read_notes(path);
}

}  // namespace parian
