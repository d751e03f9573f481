// PLY: any order of elements, any property types and lists, faces or strips of triangles, three encodings; OpenMesh
// gets float x y z and int lists.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <set>

#include "mesh_prepare.hpp"
#include "ply_header.hpp"

namespace parian {
namespace {

using namespace ply;

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

  /// Where the reading stands, for warnings: by line in ASCII, by element in binary.
  [[nodiscard]] std::pair<const char*, std::size_t> place() const {
    if (encoding_ == Encoding::ascii) return {"line", words_.line()};
    return {element.c_str(), row};
  }

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

bool is_axis(const std::string& name) { return name.size() == 1 && name[0] >= 'x' && name[0] <= 'z'; }
bool is_normal(const std::string& name) {
  return name.size() == 2 && name[0] == 'n' && name[1] >= 'x' && name[1] <= 'z';
}
bool is_indices(const std::string& name) { return name == "vertex_index" || name == "vertex_indices"; }

void read_point(Values& values, const Element& element, bool normals, PreparedMesh& mesh) {
  glm::dvec3 point(0.0);
  glm::vec3 normal(0.0F);
  for (const Property& property : element.properties) {
    if (property.count) {
      for (std::uint64_t n = values.length(property); n > 0; --n) (void)values.next(property.type);
      continue;
    }
    const double value = values.next(property.type);
    if (is_normal(property.name)) normal[property.name[1] - 'x'] = static_cast<float>(value);
    if (!is_axis(property.name)) continue;
    if (const char* fault = coordinate_fault(value))
      values.fail(fmt::format("coordinate {} is {}; remove the point or rescale the mesh", value, fault));
    point[property.name[0] - 'x'] = value;
  }
  mesh.points.push_back(point);
  if (normals) mesh.normals.push_back(normal);
}

std::int32_t checked_index(const Values& values, double value, std::uint64_t points) {
  if (!(value >= 0.0 && value < static_cast<double>(points)) || value != std::floor(value))
    values.fail(fmt::format("a face names point {}, but points are 0 to {}; correct the index", value,
                            static_cast<std::int64_t>(points) - 1));
  return static_cast<std::int32_t>(value);
}

void read_face(Values& values, const Element& element, std::uint64_t points, std::string& faces, PreparedMesh& mesh) {
  for (const Property& property : element.properties) {
    if (!property.count) {
      (void)values.next(property.type);
      continue;
    }
    const auto corners = static_cast<std::int32_t>(std::min<std::uint64_t>(values.length(property), 0x7fffffff));
    if (!is_indices(property.name)) {
      for (std::int32_t i = 0; i < corners; ++i) (void)values.next(property.type);
      continue;
    }
    const std::size_t begin = faces.size();
    append(faces, &corners, sizeof corners);
    for (std::int32_t i = 0; i < corners; ++i) {
      const std::int32_t index = checked_index(values, values.next(property.type), points);
      append(faces, &index, sizeof index);
    }
    if (corners >= 3) {
      ++mesh.faces;
    } else {
      faces.resize(begin);
      const auto [unit, number] = values.place();
      mesh.drop_face(unit, number);
    }
  }
}

/// Reads one list of strips: each triangle shares an edge with the one before, and -1 begins a new strip. Triangles
/// that name a point twice only lead from one strip to the next.
void read_strips(Values& values, const Element& element, std::uint64_t points, std::string& faces, PreparedMesh& mesh) {
  for (const Property& property : element.properties) {
    const std::uint64_t count = property.count ? values.length(property) : 1;
    std::array<std::int32_t, 4> face{3, 0, 0, 0};
    std::uint64_t length = 0;  // of the strip so far
    const auto end_strip = [&] {
      const auto [unit, number] = values.place();
      if (length == 1 || length == 2) mesh.drop_face(unit, number);
      length = 0;
    };
    for (std::uint64_t i = 0; i < count; ++i) {
      if (!is_indices(property.name)) {
        (void)values.next(property.type);
        continue;
      }
      const double value = values.next(property.type);
      if (value == -1.0) {
        end_strip();
        continue;
      }
      const std::int32_t index = checked_index(values, value, points);
      face = {3, face[2], face[3], index};
      if (++length < 3 || face[1] == face[2] || face[2] == face[3] || face[3] == face[1]) continue;
      const std::array<std::int32_t, 4> odd{3, face[2], face[1], face[3]};
      append(faces, length % 2 == 1 ? face.data() : odd.data(), sizeof face);
      ++mesh.faces;
    }
    end_strip();
  }
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

/// How many of nx, ny and nz the element has.
std::ptrdiff_t normal_axes(const Element& element) {
  return std::count_if(element.properties.begin(), element.properties.end(),
                       [](const Property& p) { return !p.count && is_normal(p.name); });
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
      if (!p.count && is_axis(p.name)) ++axes[p.name[0] - 'x'];
      if (p.count && is_indices(p.name)) ++lists;
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

/// Reads the elements down to the last that makes the surface; returns the faces as OpenMesh gets them.
std::string read_elements(const Header& header, std::uint64_t points, Values& values, PreparedMesh& mesh) {
  std::string faces;
  std::size_t last = 0;
  for (std::size_t i = 0; i < header.elements.size(); ++i) {
    const Element& element = header.elements[i];
    mesh.extras |= extras_of(element);
    if (element.name == "vertex" || is_faces(element)) last = i;
  }
  for (std::size_t i = 0; i <= last; ++i) {
    const Element& element = header.elements[i];
    if (element.properties.empty()) continue;
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
    const std::ptrdiff_t axes = is_vertex ? normal_axes(element) : 0;
    if (axes % 3 != 0) mesh.extras |= lone_normals;
    values.element = element.name;
    for (values.row = 0; values.row < element.count; ++values.row) {
      if (is_vertex)
        read_point(values, element, axes == 3, mesh);
      else if (is_face)
        read_face(values, element, points, faces, mesh);
      else if (is_faces(element))
        read_strips(values, element, points, faces, mesh);
      else
        for (const Property& property : element.properties)
          for (std::uint64_t n = property.count ? values.length(property) : 1; n > 0; --n)
            (void)values.next(property.type);
    }
  }
  return faces;
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
  if (header.textured) mesh.extras |= materials;
  Values values(bytes, header, file);
  const std::string faces = read_elements(header, points, values, mesh);
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
