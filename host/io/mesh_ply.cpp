// PLY: any order of elements, any property types and lists, faces or strips of triangles, three encodings.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "io/mesh_reading.hpp"
#include "io/ply_header.hpp"

namespace parian {
namespace {

using namespace ply;

/// The body's values one after the other, whatever the encoding.
class Values {
 public:
  Values(std::string_view body, const Header& header, const std::string& file)
      : file_(file),
        ascii_(header.encoding == Encoding::ascii),
        size_(body.size()),
        words_(body, 0, false, header.body_line),
        numbers_(body, header.encoding == Encoding::big ? std::endian::big : std::endian::little) {}

  double next(Type type) {
    if (ascii_) return next_word();
    if (numbers_.left() < size_of(type)) fail("the file ends before its last element; it is truncated");
    switch (type) {
      case Type::i8:
        return numbers_.next<std::int8_t>();
      case Type::u8:
        return numbers_.next<std::uint8_t>();
      case Type::i16:
        return numbers_.next<std::int16_t>();
      case Type::u16:
        return numbers_.next<std::uint16_t>();
      case Type::i32:
        return numbers_.next<std::int32_t>();
      case Type::u32:
        return numbers_.next<std::uint32_t>();
      case Type::f32:
        return static_cast<double>(numbers_.next<float>());
      default:
        return numbers_.next<double>();
    }
  }

  /// The length of a list, checked against what is left of the file.
  std::uint64_t length(const Property& list) {
    const double value = next(*list.count);
    if (value >= 0.0 && value * static_cast<double>(ascii_ ? 1 : size_of(list.type)) <= static_cast<double>(left())) {
      const auto whole = static_cast<std::uint64_t>(value);
      if (static_cast<double>(whole) == value) return whole;
    }
    if (!(value >= 0.0) || value != std::floor(value)) fail(fmt::format("a list has length {}; correct it", value));
    fail(fmt::format("a list of {} values can't fit into the file; it is damaged or truncated", value));
  }

  void skip(const Property& property) {
    for (std::uint64_t n = property.count ? length(property) : 1; n > 0; --n) (void)next(property.type);
  }

  [[nodiscard]] std::size_t left() const { return ascii_ ? size_ - words_.position() : numbers_.left(); }

  /// Makes a face of the corners from `begin` on. Warnings and refusals say where the reading stands: by line in ASCII,
  /// by element in binary.
  void end_face(std::size_t begin, MeshReading& reading) const {
    reading.end_face(begin, ascii_ ? "line" : element.c_str(), ascii_ ? words_.line() : row);
  }
  [[noreturn]] void fail(const std::string& message) const {
    if (ascii_) refuse(file_, words_.line(), message);
    refuse(file_, fmt::format("{} {}: {}", element, row, message));
  }

  std::string element;
  std::uint64_t row = 0;

 private:
  double next_word() {
    const std::string_view word = words_.next();
    if (word.empty()) fail("the file ends before its last element; it is truncated");
    double value = 0.0;
    if (!parse_number(word, value)) fail(fmt::format("'{:.40}' is not a number; correct it", word));
    return value;
  }

  const std::string& file_;
  bool ascii_;
  std::size_t size_;
  Words words_;
  Numbers numbers_;
};

/// Where the values of a point's property go: x, y, z, nx, ny, nz, or nowhere.
constexpr std::size_t nowhere = 6;
std::size_t slot_of(const Property& property) {
  constexpr std::array<std::string_view, nowhere> names{"x", "y", "z", "nx", "ny", "nz"};
  return property.count ? nowhere : std::find(names.begin(), names.end(), property.name) - names.begin();
}

bool is_indices(const Property& property) {
  return property.count && (property.name == "vertex_indices" || property.name == "vertex_index");
}

void read_points(Values& values, const Element& element, MeshReading& reading) {
  std::vector<std::size_t> slots;
  for (const Property& property : element.properties) slots.push_back(slot_of(property));
  const auto axes =
      std::count_if(slots.begin(), slots.end(), [](std::size_t slot) { return slot >= 3 && slot < nowhere; });
  if (axes % 3 != 0) reading.extras |= lone_normals;
  reading.mesh.points.reserve(element.count);
  for (values.row = 0; values.row < element.count; ++values.row) {
    std::array<double, nowhere> point{};
    for (std::size_t i = 0; i < slots.size(); ++i) {
      if (slots[i] == nowhere) {
        values.skip(element.properties[i]);
        continue;
      }
      const double value = point[slots[i]] = values.next(element.properties[i].type);
      const char* fault = slots[i] < 3 ? coordinate_fault(value) : nullptr;
      if (fault) values.fail(fmt::format("coordinate {} is {}; remove the point or rescale the mesh", value, fault));
    }
    reading.mesh.points.emplace_back(point[0], point[1], point[2]);
    if (axes == 3) reading.mesh.normals.emplace_back(point[3], point[4], point[5]);
  }
}

std::uint32_t checked_index(const Values& values, double value, std::uint64_t points) {
  const std::uint32_t index =
      value >= 0.0 && value < static_cast<double>(points) ? static_cast<std::uint32_t>(value) : 0;
  if (static_cast<double>(index) != value || index >= points)
    values.fail(fmt::format("a face names point {}, but points are 0 to {}; correct the index", value,
                            static_cast<std::int64_t>(points) - 1));
  return index;
}

/// Reads a list of a face's corners.
void read_face(Values& values, const Property& list, std::uint64_t points, MeshReading& reading) {
  std::vector<std::uint32_t>& corners = reading.mesh.corners;
  const std::size_t begin = corners.size();
  for (std::uint64_t n = values.length(list); n > 0; --n)
    corners.push_back(checked_index(values, values.next(list.type), points));
  values.end_face(begin, reading);
}

/// Reads a list of strips: each triangle shares an edge with the one before, and -1 begins a new strip. Triangles that
/// name a point twice only lead from one strip to the next.
void read_strips(Values& values, const Property& list, std::uint64_t points, MeshReading& reading) {
  std::vector<std::uint32_t>& corners = reading.mesh.corners;
  std::array<std::uint32_t, 3> face{};
  std::uint64_t length = 0;  // of the strip so far
  const auto end_strip = [&] {
    if (length == 1 || length == 2) values.end_face(corners.size(), reading);
    length = 0;
  };
  for (std::uint64_t n = values.length(list); n > 0; --n) {
    const double value = values.next(list.type);
    if (value == -1.0) {
      end_strip();
      continue;
    }
    face = {face[1], face[2], checked_index(values, value, points)};
    if (++length < 3 || face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) continue;
    const std::size_t begin = corners.size(), odd = length % 2 == 0;
    corners.insert(corners.end(), {face[odd], face[1 - odd], face[2]});
    values.end_face(begin, reading);
  }
  end_strip();
}

/// What else the properties of an element are.
unsigned extras_of(const Element& element) {
  const auto has = [&](std::initializer_list<std::string_view> names) {
    return std::any_of(element.properties.begin(), element.properties.end(),
                       [&](const Property& p) { return std::find(names.begin(), names.end(), p.name) != names.end(); });
  };
  unsigned extras = 0;
  if (has({"red", "green", "blue", "diffuse_red", "diffuse_green", "diffuse_blue", "r", "g", "b"}))
    extras |= element.name == "vertex" ? point_colours : face_colours;
  if (has({"s", "t", "u", "v", "texture_s", "texture_t", "texture_u", "texture_v", "texcoord", "texnumber"}))
    extras |= texture_coordinates;
  if (has({"material_index", "material_indices"}) || element.name == "material") extras |= materials;
  if (element.name == "edge" && element.count > 0) extras |= curves;
  return extras;
}

/// Refuses points without a surface, and says what they are.
[[noreturn]] void refuse_cloud(const Header& header, const std::string& file) {
  for (const Element& element : header.elements)
    for (const Property& property : element.properties)
      if (property.name == "f_dc_0" || property.name == "packed_position" || property.name == "rot_0")
        refuse(file,
               "the PLY file has no faces: this is a Gaussian splat, which has no surface; make a mesh of what "
               "it was made of");
  refuse(file,
         "the PLY file has no faces: this is a point cloud; make a surface of it, with MeshLab's or CloudCompare's "
         "Poisson reconstruction for one");
}

bool is_faces(const Element& element) { return element.name == "face" || element.name == "tristrips"; }

/// Refuses elements without what makes a mesh, and counts that can't fit into the file.
void check_elements(const Header& header, std::size_t left, const std::string& file) {
  std::set<std::string> met;
  bool faces = false;
  for (const Element& element : header.elements) faces |= is_faces(element) && element.count > 0;
  if (!faces) refuse_cloud(header, file);
  for (const Element& element : header.elements) {
    std::uint64_t least = 0;
    std::array<int, 3> axes{};
    int lists = 0;
    for (const Property& p : element.properties) {
      least += header.encoding == Encoding::ascii ? 2 : size_of(p.count ? *p.count : p.type);
      if (slot_of(p) < axes.size()) ++axes[slot_of(p)];
      if (is_indices(p)) ++lists;
    }
    if (!met.insert(element.name).second && (element.name == "vertex" || is_faces(element)))
      refuse(file, fmt::format("the header has two elements '{}'; correct it", element.name));
    if (element.name == "vertex" && axes != std::array<int, 3>{1, 1, 1})
      refuse(file, "the vertices need the properties x, y and z, once each; correct the header");
    if (is_faces(element) && lists != 1)
      refuse(file, fmt::format("the element '{}' needs one list vertex_indices; correct the header", element.name));
    // A last ASCII line may lack its end.
    if (element.count * least > left + 1)
      refuse(file, fmt::format("the header promises {} of element '{}', which need at least {} bytes, but {} follow; "
                               "the file is damaged or truncated",
                               element.count, element.name, element.count * least, left));
  }
  if (!met.contains("vertex")) refuse(file, "the PLY file has no vertices; choose a mesh");
}

/// Reads the elements down to the last that makes the surface.
void read_elements(const Header& header, std::uint64_t points, Values& values, MeshReading& reading) {
  std::size_t last = 0;
  for (std::size_t i = 0; i < header.elements.size(); ++i) {
    const Element& element = header.elements[i];
    reading.extras |= extras_of(element);
    if (element.name == "vertex" || is_faces(element)) last = i;
  }
  for (std::size_t i = 0; i <= last; ++i) {
    const Element& element = header.elements[i];
    values.element = element.name;
    if (element.name == "vertex") {
      read_points(values, element, reading);
      continue;
    }
    const bool faces = is_faces(element), strips = element.name == "tristrips";
    if (faces) reading.mesh.face_sizes.reserve(element.count);
    if (faces) reading.mesh.corners.reserve(std::min(3 * element.count, values.left()));
    for (values.row = 0; values.row < element.count && !element.properties.empty(); ++values.row)
      for (const Property& property : element.properties) {
        if (!faces || !is_indices(property))
          values.skip(property);
        else if (strips)
          read_strips(values, property, points, reading);
        else
          read_face(values, property, points, reading);
      }
  }
}

}  // namespace

MeshReading read_ply(std::string_view bytes, const std::string& file) {
  const Header header = read_header(bytes, file);
  check_elements(header, bytes.size() - header.body, file);
  std::uint64_t points = 0;
  for (const Element& element : header.elements)
    if (element.name == "vertex") points = element.count;
  if (points > 0x7fffffff) refuse(file, "more than 2147483647 points; use a smaller mesh");
  MeshReading reading;
  if (header.textured) reading.extras |= materials;
  Values values(bytes.substr(header.body), header, file);
  read_elements(header, points, values, reading);
  return reading;
}

}  // namespace parian
