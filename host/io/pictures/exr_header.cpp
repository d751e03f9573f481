// Attributes one after the other: a name, a type, a size, and as many bytes. An empty name ends a part's header, and
// another one behind it those of a file of several parts.
#include "io/pictures/exr_header.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <fstream>

namespace parian::pictures {
namespace {

constexpr std::uint32_t magic = 20000630, several_parts = 1U << 12;
constexpr std::size_t longest_name = 255;

/// Four bytes, little-endian.
std::uint32_t read_number(std::istream& stream) {
  std::array<char, 4> bytes{};
  stream.read(bytes.data(), bytes.size());
  std::uint32_t number = 0;
  for (int i = 3; i >= 0; --i) number = number << 8 | static_cast<unsigned char>(bytes[i]);
  return number;
}

/// A name up to its zero byte; the stream fails where it is too long or there is none.
std::string read_name(std::istream& stream) {
  std::string name;
  for (char c = 0; stream.get(c) && c != 0; name += c)
    if (name.size() == longest_name) stream.setstate(std::ios::failbit);
  return name;
}

}  // namespace

std::string exr_header_fault(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (read_number(stream) != magic) return {};
  const std::uint32_t version = read_number(stream);
  std::error_code failed;
  const std::uint64_t size = std::filesystem::file_size(path, failed);
  std::size_t attributes = 0;  // of this part
  while (stream) {
    if (read_name(stream).empty()) {
      if (!stream) break;
      if (attributes == 0 || !(version & several_parts)) return {};
      attributes = 0;
      continue;
    }
    (void)read_name(stream);  // the type
    const std::uint32_t bytes = read_number(stream);
    if (!stream) break;
    const auto at = static_cast<std::uint64_t>(stream.tellg());
    if (bytes > size - at) return fmt::format("promises an attribute of {} bytes where {} are left", bytes, size - at);
    stream.seekg(bytes, std::ios::cur);
    ++attributes;
  }
  return "ends within its header";
}

}  // namespace parian::pictures
