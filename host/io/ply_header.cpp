// Reads PLY headers line by line.
#include "io/ply_header.hpp"

#include <fmt/format.h>

#include <array>

#include "io/mesh_reading.hpp"

namespace parian::ply {
namespace {

Type type_named(std::string_view name, const std::string& file, std::size_t line) {
  constexpr std::array<std::pair<std::string_view, Type>, 16> names{{{"char", Type::i8},
                                                                     {"int8", Type::i8},
                                                                     {"uchar", Type::u8},
                                                                     {"uint8", Type::u8},
                                                                     {"short", Type::i16},
                                                                     {"int16", Type::i16},
                                                                     {"ushort", Type::u16},
                                                                     {"uint16", Type::u16},
                                                                     {"int", Type::i32},
                                                                     {"int32", Type::i32},
                                                                     {"uint", Type::u32},
                                                                     {"uint32", Type::u32},
                                                                     {"float", Type::f32},
                                                                     {"float32", Type::f32},
                                                                     {"double", Type::f64},
                                                                     {"float64", Type::f64}}};
  for (const auto& [known, type] : names)
    if (known == name) return type;
  refuse(file, line, fmt::format("unknown PLY type '{:.40}'; types are char to double and int8 to float64", name));
}

Element read_element(Words& words, const std::string& file) {
  Element element{std::string(words.next_in_line()), 0, {}};
  std::int64_t count = 0;
  const std::string_view word = words.next_in_line();
  if (element.name.empty() || !parse_integer(word, count) || count < 0 || count > 0xfffffffe)
    refuse(file, words.line(), fmt::format("'{:.40}' is not a possible count of elements; correct the header", word));
  element.count = static_cast<std::uint64_t>(count);
  return element;
}

Property read_property(Words& words, const std::string& file) {
  Property property;
  std::string_view word = words.next_in_line();
  if (word == "list") {
    property.count = type_named(words.next_in_line(), file, words.line());
    if (*property.count == Type::f32 || *property.count == Type::f64)
      refuse(file, words.line(), "a list's length can't be a floating-point number; correct the header");
    word = words.next_in_line();
  }
  property.type = type_named(word, file, words.line());
  property.name = words.next_in_line();
  return property;
}

}  // namespace

Header read_header(std::string_view bytes, const std::string& file) {
  Words words(bytes);
  const std::string_view magic = words.next_in_line();
  if (magic != "ply" && magic != "PLY") refuse(file, 1, "this isn't a PLY file, whose first line is 'ply'");
  Header header;
  bool has_format = false;
  while (words.next_line()) {
    const std::string_view key = words.next_in_line();
    if (key == "format") {
      const std::string_view name = words.next_in_line();
      if (name != "ascii" && name != "binary_little_endian" && name != "binary_big_endian")
        refuse(file, words.line(), fmt::format("unknown PLY format '{:.40}'; convert the file", name));
      header.encoding = name == "ascii"                  ? Encoding::ascii
                        : name == "binary_little_endian" ? Encoding::little
                                                         : Encoding::big;
      has_format = true;
    } else if (key == "element") {
      header.elements.push_back(read_element(words, file));
    } else if (key == "property") {
      if (header.elements.empty()) refuse(file, words.line(), "a property before any element; correct the header");
      header.elements.back().properties.push_back(read_property(words, file));
    } else if (key == "end_header") {
      if (!has_format) refuse(file, words.line(), "the header names no format; add a line 'format ascii 1.0'");
      if (!words.next_line()) break;
      header.body = words.position();
      header.body_line = words.line();
      return header;
    } else if (key == "comment") {
      header.textured |= words.next_in_line() == "TextureFile";
    } else if (key != "obj_info" && !key.empty()) {
      refuse(file, words.line(), fmt::format("unknown keyword '{:.40}' in a PLY header; remove the line", key));
    }
  }
  refuse(file, words.line(), "the file ends within the PLY header; it is truncated");
}

}  // namespace parian::ply
