// The header of a PLY file: its elements, their properties, and where the body begins.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace parian::ply {

enum class Type { i8, u8, i16, u16, i32, u32, f32, f64 };

struct Property {
  std::string name;
  Type type = Type::f32;
  std::optional<Type> count;  ///< set: a list, whose length has this type
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { ascii, little, big };

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::size_t body = 0;       ///< offset of the first byte after the header
  std::size_t body_line = 0;  ///< its line
  bool textured = false;      ///< a comment names a picture
};

/// Bytes of a number of that type.
[[nodiscard]] constexpr std::size_t size_of(Type type) {
  constexpr std::array<std::size_t, 8> sizes{1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[static_cast<std::size_t>(type)];
}

/// Reads the header. Throws Error(input) with the line.
[[nodiscard]] Header read_header(std::string_view bytes, const std::string& file);

}  // namespace parian::ply
