// STL: triangles as three positions each, in ASCII or binary; equal positions become one point.
#include <fmt/format.h>

#include <algorithm>

#include "core/ascii.hpp"
#include "io/mesh_reading.hpp"

namespace parian {
namespace {

constexpr std::size_t header_size = 84;  // with the count behind it
constexpr std::size_t triangle_size = 50;

bool same(std::string_view word, std::string_view lower) {
  return std::equal(word.begin(), word.end(), lower.begin(), lower.end(),
                    [](char a, char b) { return ascii::lower(a) == b; });
}

std::uint32_t promised_triangles(std::string_view bytes) {
  return Numbers(bytes.substr(header_size - 4), std::endian::little).next<std::uint32_t>();
}

/// ASCII begins with "solid"; so do many binary headers, which are told by their exact size or by a zero byte.
bool is_ascii(std::string_view bytes) {
  Words words(bytes);
  if (!same(words.next(), "solid")) return false;
  if (bytes.size() < header_size) return true;
  if (header_size + triangle_size * std::uint64_t{promised_triangles(bytes)} == bytes.size()) return false;
  return bytes.find('\0') == std::string_view::npos;
}

void read_binary(std::string_view bytes, MeshReading& reading, const std::string& file) {
  if (bytes.size() < header_size) refuse(file, "this is neither an ASCII nor a binary STL file, or it is truncated");
  const std::uint32_t triangles = promised_triangles(bytes);
  if (triangles == 0) refuse(file, "the STL file has no triangles; choose a mesh");
  const std::uint64_t needed = header_size + triangle_size * std::uint64_t{triangles};
  if (needed > bytes.size())
    refuse(file, fmt::format("the header promises {} triangles, which need {} bytes, but the file has {}; it is "
                             "damaged or truncated",
                             triangles, needed, bytes.size()));
  // Colours of triangles: "COLOR=" in the header, or the highest bit of the two bytes behind each.
  bool coloured = bytes.substr(0, 80).find("COLOR=") != std::string_view::npos;
  Numbers numbers(bytes.substr(header_size), std::endian::little);
  reading.mesh.points.reserve(3 * std::size_t{triangles});
  for (std::uint32_t i = 0; i < triangles; ++i) {
    numbers.skip(12);  // the normal
    for (int k = 0; k < 3; ++k) {
      glm::dvec3& point = reading.mesh.points.emplace_back();
      for (int axis = 0; axis < 3; ++axis) {
        point[axis] = static_cast<double>(numbers.next<float>());
        if (const char* fault = coordinate_fault(point[axis]))
          refuse(file, fmt::format("triangle {}: a coordinate is {}; remove the triangle", i, fault));
      }
    }
    coloured |= numbers.next<std::uint16_t>() >= 0x8000U;
  }
  if (coloured) reading.extras |= face_colours;
}

void read_ascii(std::string_view bytes, MeshReading& reading, const std::string& file) {
  std::vector<glm::dvec3>& points = reading.mesh.points;
  Words words(bytes);
  int corners = -1;  // outside a loop
  do {
    for (std::string_view word = words.next_in_line(); !word.empty(); word = words.next_in_line()) {
      if (same(word, "solid") || same(word, "endsolid")) {
        if (corners >= 0) refuse(file, words.line(), "a solid ends within a facet; the file is damaged");
        break;  // the rest is a name
      }
      if (same(word, "outer")) {
        if (corners >= 0) refuse(file, words.line(), "a facet begins within another; the file is damaged");
        corners = 0;
      } else if (same(word, "vertex")) {
        if (corners < 0) refuse(file, words.line(), "a vertex outside 'outer loop'; the file is damaged");
        ++corners;
        glm::dvec3& point = points.emplace_back();
        for (int axis = 0; axis < 3; ++axis)
          point[axis] = static_cast<double>(read_coordinate<float>(words.next_in_line(), file, words.line()));
      } else if (same(word, "endloop")) {
        if (corners > 3 || corners < 0)
          refuse(file, words.line(), "a facet doesn't have 3 vertices; convert the mesh to PLY or OBJ");
        if (corners < 3) {
          points.resize(points.size() - corners);
          reading.end_face(0, "line", words.line());
        }
        corners = -1;
      }
    }
  } while (words.next_line());
  if (corners >= 0) refuse(file, words.line(), "the file ends within a facet; it is truncated");
  if (points.empty()) refuse(file, "the STL file has no triangles; choose a mesh");
}

/// Makes faces of points that are three for each triangle, but of those that have two at the same position.
void join_corners(PolygonMesh& mesh) {
  std::vector<std::uint32_t> number = join_points(mesh.points);
  std::uint32_t points = 0;
  for (std::size_t i = 0; i < number.size(); ++i) {
    const bool first = number[i] == i;
    if (first) mesh.points[points] = mesh.points[i];
    number[i] = first ? points++ : number[number[i]];
  }
  mesh.points.resize(points);
  mesh.face_sizes.reserve(number.size() / 3);
  mesh.corners.reserve(number.size());
  for (std::size_t i = 0; i < number.size(); i += 3) {
    if (number[i] == number[i + 1] || number[i + 1] == number[i + 2] || number[i + 2] == number[i]) continue;
    mesh.corners.insert(mesh.corners.end(), number.begin() + i, number.begin() + i + 3);
    mesh.face_sizes.push_back(3);
  }
}

}  // namespace

MeshReading read_stl(std::string_view bytes, const std::string& file) {
  MeshReading reading;
  (is_ascii(bytes) ? read_ascii : read_binary)(bytes, reading, file);
  join_corners(reading.mesh);
  if (reading.mesh.face_sizes.empty())
    refuse(file, "the mesh has no faces with three different corners; choose another");
  return reading;
}

}  // namespace parian
