// PLY: any order of elements, any property types and lists, three encodings; OpenMesh gets float x y z and int lists.
#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>

#include "mesh_prepare.hpp"

namespace parian {
namespace {

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
};

std::size_t size_of(Type type) {
  constexpr std::array<std::size_t, 8> sizes{1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[static_cast<std::size_t>(type)];
}

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

Header read_header(const std::string& bytes, const std::string& file) {
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
    } else if (key != "comment" && key != "obj_info" && !key.empty()) {
      refuse(file, words.line(), fmt::format("unknown keyword '{:.40}' in a PLY header; remove the line", key));
    }
  }
  refuse(file, words.line(), "the file ends within the PLY header; it is truncated");
}

/// The body's values one after the other, whatever the encoding.
class Values {
 public:
  Values(const std::string& bytes, const Header& header, const std::string& file)
      : bytes_(bytes),
        file_(file),
        encoding_(header.encoding),
        swap_((header.encoding == Encoding::big) != (std::endian::native == std::endian::big)),
        position_(header.body),
        words_(std::string_view(bytes).substr(header.body), 0, header.body_line) {}

  double next(Type type) {
    if (encoding_ == Encoding::ascii) {
      const std::string_view word = words_.next();
      if (word.empty()) fail("the file ends before its last element; it is truncated");
      double value = 0.0;
      if (!parse_number(word, value)) fail(fmt::format("'{:.40}' is not a number; correct it", word));
      return value;
    }
    const std::size_t size = size_of(type);
    if (left() < size) fail("the file ends before its last element; it is truncated");
    std::array<char, 8> raw{};
    for (std::size_t i = 0; i < size; ++i) raw[swap_ ? size - 1 - i : i] = bytes_[position_ + i];
    position_ += size;
    switch (type) {
      case Type::i8:
        return as<std::int8_t>(raw);
      case Type::u8:
        return as<std::uint8_t>(raw);
      case Type::i16:
        return as<std::int16_t>(raw);
      case Type::u16:
        return as<std::uint16_t>(raw);
      case Type::i32:
        return as<std::int32_t>(raw);
      case Type::u32:
        return as<std::uint32_t>(raw);
      case Type::f32:
        return static_cast<double>(as<float>(raw));
      default:
        return as<double>(raw);
    }
  }

  /// The length of a list, checked against what is left of the file.
  std::uint64_t length(const Property& list) {
    const double value = next(*list.count);
    const std::size_t least = encoding_ == Encoding::ascii ? 1 : size_of(list.type);
    if (!(value >= 0.0) || value != std::floor(value)) fail(fmt::format("a list has length {}; correct it", value));
    if (value * static_cast<double>(least) > static_cast<double>(left()))
      fail(fmt::format("a list of {} values can't fit into the file; it is damaged or truncated", value));
    return static_cast<std::uint64_t>(value);
  }

  [[nodiscard]] std::size_t left() const {
    return bytes_.size() - (encoding_ == Encoding::ascii ? words_.position() : position_);
  }

  /// Refuses the file where the reading stands: by line in ASCII, by element in binary.
  [[noreturn]] void fail(const std::string& message) const {
    if (encoding_ == Encoding::ascii) refuse(file_, words_.line(), message);
    refuse(file_, fmt::format("{} {}: {}", element, row, message));
  }

  std::string element;
  std::uint64_t row = 0;

 private:
  template <class T>
  static T as(const std::array<char, 8>& raw) {
    T value;
    std::memcpy(&value, raw.data(), sizeof value);
    return value;
  }

  const std::string& bytes_;
  const std::string& file_;
  Encoding encoding_;
  bool swap_;
  std::size_t position_;
  Words words_;
};

void append(std::string& stream, const void* data, std::size_t size) {
  stream.append(static_cast<const char*>(data), size);
}

void read_point(Values& values, const Element& element, std::vector<glm::dvec3>& points) {
  glm::dvec3 point(0.0);
  for (const Property& property : element.properties) {
    if (property.count) {
      for (std::uint64_t n = values.length(property); n > 0; --n) (void)values.next(property.type);
      continue;
    }
    const double value = values.next(property.type);
    if (property.name.size() != 1 || property.name[0] < 'x' || property.name[0] > 'z') continue;
    if (const char* fault = coordinate_fault(value))
      values.fail(fmt::format("coordinate {} is {}; remove the point or rescale the mesh", value, fault));
    point[property.name[0] - 'x'] = value;
  }
  points.push_back(point);
}

void read_face(Values& values, const Element& element, std::uint64_t points, std::string& faces) {
  for (const Property& property : element.properties) {
    if (!property.count) {
      (void)values.next(property.type);
      continue;
    }
    const auto corners = static_cast<std::int32_t>(std::min<std::uint64_t>(values.length(property), 0x7fffffff));
    const bool indices = property.name == "vertex_index" || property.name == "vertex_indices";
    if (indices && corners < 3) values.fail(fmt::format("a face has {} corners; remove it", corners));
    if (indices) append(faces, &corners, sizeof corners);
    for (std::int32_t i = 0; i < corners; ++i) {
      const double value = values.next(property.type);
      if (!indices) continue;
      if (!(value >= 0.0 && value < static_cast<double>(points)) || value != std::floor(value))
        values.fail(fmt::format("a face names point {}, but points are 0 to {}; correct the index", value,
                                static_cast<std::int64_t>(points) - 1));
      const auto index = static_cast<std::int32_t>(value);
      append(faces, &index, sizeof index);
    }
  }
}

/// Refuses elements without what makes a mesh, and counts that can't fit into the file.
void check_elements(const Header& header, std::size_t left, const std::string& file) {
  bool vertex = false;
  bool face = false;
  for (const Element& element : header.elements) {
    std::uint64_t least = 0;
    std::array<int, 3> axes{};
    int lists = 0;
    for (const Property& p : element.properties) {
      least += header.encoding == Encoding::ascii ? 2 : size_of(p.count ? *p.count : p.type);
      if (!p.count && p.name.size() == 1 && p.name[0] >= 'x' && p.name[0] <= 'z') ++axes[p.name[0] - 'x'];
      if (p.count && (p.name == "vertex_index" || p.name == "vertex_indices")) ++lists;
    }
    const bool is_vertex = element.name == "vertex";
    const bool is_face = element.name == "face";
    if ((is_vertex && vertex) || (is_face && face))
      refuse(file, fmt::format("the header has two elements '{}'; correct it", element.name));
    if (is_vertex && axes != std::array<int, 3>{1, 1, 1})
      refuse(file, "the vertices need the properties x, y and z, once each; correct the header");
    if (is_face && lists != 1) refuse(file, "the faces need one list vertex_indices; correct the header");
    // A last ASCII line may lack its end.
    if (element.count * least > left + 1)
      refuse(file, fmt::format("the header promises {} of element '{}', which need at least {} bytes, but {} follow; "
                               "the file is damaged or truncated",
                               element.count, element.name, element.count * least, left));
    vertex |= is_vertex;
    face |= is_face && element.count > 0;
  }
  if (!vertex) refuse(file, "the PLY file has no vertices; choose a mesh");
  if (!face) refuse(file, "the PLY file has no faces (a point cloud?); choose a mesh");
}

}  // namespace

PreparedMesh prepare_ply(const std::string& bytes, const std::string& file) {
  const Header header = read_header(bytes, file);
  check_elements(header, bytes.size() - header.body, file);
  std::uint64_t points = 0;
  for (const Element& element : header.elements)
    if (element.name == "vertex") points = element.count;
  if (points > 0x7fffffff) refuse(file, "more than 2147483647 points; use a smaller mesh");
  PreparedMesh mesh;
  std::string faces;
  Values values(bytes, header, file);
  bool has_points = false;
  for (const Element& element : header.elements) {
    if (has_points && mesh.faces > 0) break;
    if (element.properties.empty()) continue;
    const bool is_vertex = element.name == "vertex";
    const bool is_face = element.name == "face";
    values.element = element.name;
    for (values.row = 0; values.row < element.count; ++values.row) {
      if (is_vertex)
        read_point(values, element, mesh.points);
      else if (is_face)
        read_face(values, element, points, faces);
      else
        for (const Property& property : element.properties)
          for (std::uint64_t n = property.count ? values.length(property) : 1; n > 0; --n)
            (void)values.next(property.type);
    }
    has_points |= is_vertex;
    if (is_face) mesh.faces = element.count;
  }
  mesh.stream = fmt::format(
      "ply\nformat binary_{}_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "element face {}\nproperty list int int vertex_indices\nend_header\n",
      std::endian::native == std::endian::big ? "big" : "little", mesh.points.size(), mesh.faces);
  mesh.stream.reserve(mesh.stream.size() + 12 * mesh.points.size() + faces.size() + 1);
  for (const glm::dvec3& point : mesh.points) {
    const std::array<float, 3> rounded{static_cast<float>(point.x), static_cast<float>(point.y),
                                       static_cast<float>(point.z)};
    append(mesh.stream, rounded.data(), sizeof rounded);
  }
  mesh.stream += faces;
  return mesh;
}

}  // namespace parian
