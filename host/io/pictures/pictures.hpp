// What needs OpenImageIO, apart from everything else: it brings 250 libraries, which take longer to load than a mesh of
// 100,000 triangles. So this is a module, which image_file.cpp loads at the first picture.
#pragma once
#include "io/image_file.hpp"

namespace parian::pictures {

/// As check_output, of the format alone.
void check_format(const std::filesystem::path& path, glm::uvec2 film);
/// As those of image_file.hpp.
[[nodiscard]] std::string png_base64(const Image& image, double stops);
void write(const std::filesystem::path& path, const Image& image, const PictureNotes& notes, const Exposure& exposure);
[[nodiscard]] Image read(const std::filesystem::path& path);
[[nodiscard]] std::map<std::string, std::string> read_notes(const std::filesystem::path& path);

/// The functions above, as the module hands them over under the name "parian_pictures".
struct Functions {
  decltype(&pictures::check_format) check_format;
  decltype(&pictures::png_base64) png_base64;
  decltype(&pictures::write) write;
  decltype(&pictures::read) read;
  decltype(&pictures::read_notes) read_notes;
};

}  // namespace parian::pictures
