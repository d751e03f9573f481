// OBJ: points, normals and faces; materials and textures stay out.
#include <fmt/format.h>

#include "io/mesh_reading.hpp"

namespace parian {
namespace {

struct Face {
  std::size_t line;
  std::size_t begin;  ///< of its corners
};

constexpr std::int64_t none = -1;  // of a corner without a normal

/// What faces name, counted from 0: a point each and, once one has been named, a normal.
struct Corners {
  std::vector<std::int64_t> points, normals;

  void add(std::int64_t point, std::int64_t normal) {
    points.push_back(point);
    if (normal == none && normals.empty()) return;
    normals.resize(points.size(), none);
    normals.back() = normal;
  }
  [[nodiscard]] std::int64_t normal(std::size_t i) const { return normals.empty() ? none : normals[i]; }
};

/// The index of a corner's normal, from "point/texture/normal", or none.
std::int64_t normal_of(std::string_view word, std::size_t normals, const std::string& file, std::size_t line) {
  const std::size_t first = word.find('/');
  const std::size_t second = first == std::string_view::npos ? first : word.find('/', first + 1);
  if (second == std::string_view::npos || second + 1 == word.size()) return none;
  std::int64_t index = 0;
  if (!parse_integer(word.substr(second + 1), index) || index == 0)
    refuse(file, line, fmt::format("'{:.40}' is not a corner of a face; normals count from 1", word));
  if (index < 0) index += static_cast<std::int64_t>(normals) + 1;
  if (index <= 0)
    refuse(file, line, fmt::format("'{:.40}' reaches back before the first normal; {} stand above", word, normals));
  return index - 1;
}

/// Reads the corners of one face, each "point/texture/normal" with one-based or negative indices.
void read_corners(Words& words, std::size_t points, std::size_t normals, Corners& corners, const std::string& file) {
  for (std::string_view word = words.next_in_line(); !word.empty(); word = words.next_in_line()) {
    std::int64_t index = 0;
    if (!parse_integer(word.substr(0, word.find('/')), index) || index == 0)
      refuse(file, words.line(), fmt::format("'{:.40}' is not a corner of a face; points count from 1", word));
    if (index < 0) index += static_cast<std::int64_t>(points) + 1;
    if (index <= 0)
      refuse(file, words.line(),
             fmt::format("'{:.40}' reaches back before the first point; {} points stand above", word, points));
    corners.add(index - 1, normal_of(word, normals, file, words.line()));
  }
}

/// The rest of a line that begins with "vn". What isn't finite is left for clean_mesh to go without.
glm::vec3 read_normal(Words& words, const std::string& file) {
  glm::dvec3 normal(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    const std::string_view word = words.next_in_line();
    if (!parse_number(word, normal[axis]))
      refuse(file, words.line(), fmt::format("'{:.40}' is not a number; correct the normal", word));
  }
  return glm::vec3(normal);
}

/// The rest of a line that begins with "v": coordinates, and perhaps a weight or a colour.
void read_point(Words& words, MeshReading& reading, const std::string& file) {
  glm::dvec3& point = reading.mesh.points.emplace_back();
  for (int axis = 0; axis < 3; ++axis) point[axis] = read_coordinate<double>(words.next_in_line(), file, words.line());
  const bool weight = !words.next_in_line().empty();
  if (weight && !words.next_in_line().empty()) reading.extras |= point_colours;
}

/// What else a line may hold that begins with `key`.
unsigned extra_of(std::string_view key) {
  if (key == "vt") return texture_coordinates;
  if (key == "usemtl" || key == "mtllib") return materials;
  return key == "l" || key == "p" || key == "curv" || key == "curv2" || key == "surf" ? unsigned{curves} : 0U;
}

/// Adds a face once all points and normals are known that it may name.
void add_face(const Corners& corners, std::size_t begin, std::size_t end, std::size_t line, MeshReading& reading,
              const std::string& file) {
  PolygonMesh& mesh = reading.mesh;
  const std::size_t first = mesh.corners.size();
  for (std::size_t i = begin; i < end; ++i) {
    const std::int64_t point = corners.points[i], normal = corners.normal(i);
    if (point >= static_cast<std::int64_t>(mesh.points.size()))
      refuse(
          file, line,
          fmt::format("a face names point {}, but the file has {}; correct the index", point + 1, mesh.points.size()));
    if (normal >= static_cast<std::int64_t>(mesh.normals.size()))
      refuse(file, line,
             fmt::format("a face names normal {}, but the file has {}; correct the index", normal + 1,
                         mesh.normals.size()));
    mesh.corners.push_back(static_cast<std::uint32_t>(point));
    if (!corners.normals.empty() && end - begin >= 3)
      mesh.corner_normals.push_back(normal == none ? no_normal : static_cast<std::uint32_t>(normal));
  }
  reading.end_face(first, "line", line);
}

}  // namespace

MeshReading read_obj(std::string_view bytes, const std::string& file) {
  MeshReading reading;
  PolygonMesh& mesh = reading.mesh;
  Corners corners;
  std::vector<Face> faces;
  Words words(bytes, '#', true);
  do {
    const std::string_view key = words.next_in_line();
    if (key == "v") {
      read_point(words, reading, file);
    } else if (key == "vn") {
      mesh.normals.push_back(read_normal(words, file));
    } else if (key == "f") {
      faces.push_back({words.line(), corners.points.size()});
      read_corners(words, mesh.points.size(), mesh.normals.size(), corners, file);
    } else {
      reading.extras |= extra_of(key);
    }
  } while (words.next_line());
  if (faces.empty()) refuse(file, "the OBJ file has no faces; choose a mesh");
  mesh.face_sizes.reserve(faces.size());
  mesh.corners.reserve(corners.points.size());
  for (std::size_t f = 0; f < faces.size(); ++f)
    add_face(corners, faces[f].begin, f + 1 < faces.size() ? faces[f + 1].begin : corners.points.size(), faces[f].line,
             reading, file);
  // Normals that no face names: where there is one for each point, that is what they are.
  if (corners.normals.empty() && mesh.normals.size() != mesh.points.size()) {
    if (!mesh.normals.empty()) reading.extras |= lone_normals;
    mesh.normals.clear();
  }
  return reading;
}

}  // namespace parian
