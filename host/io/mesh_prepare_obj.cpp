// OBJ: OpenMesh gets the points and the faces' point indices; normals go past it, materials and textures stay out.
#include <fmt/format.h>

#include <algorithm>

#include "mesh.hpp"
#include "mesh_prepare.hpp"

namespace parian {
namespace {

/// The text with lines joined that end in a backslash; the line count stays right by moving the break behind them.
std::string join_lines(const std::string& bytes) {
  std::string text;
  text.reserve(bytes.size());
  std::size_t owed = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const bool cr = bytes[i] == '\\' && i + 2 < bytes.size() && bytes[i + 1] == '\r' && bytes[i + 2] == '\n';
    if (cr || (bytes[i] == '\\' && i + 1 < bytes.size() && bytes[i + 1] == '\n')) {
      text += ' ';
      ++owed;
      i += cr ? 2 : 1;
      continue;
    }
    text += bytes[i];
    if (bytes[i] != '\n') continue;
    text.append(owed, '\n');
    owed = 0;
  }
  return text;
}

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
void read_point(Words& words, PreparedMesh& mesh, const std::string& file) {
  glm::dvec3 point(0.0);
  mesh.stream += "v";
  for (int axis = 0; axis < 3; ++axis) {
    mesh.stream += ' ';
    mesh.stream += read_coordinate(words.next_in_line(), point[axis], file, words.line());
  }
  mesh.stream += '\n';
  mesh.points.push_back(point);
  const bool weight = !words.next_in_line().empty();
  if (weight && !words.next_in_line().empty()) mesh.extras |= point_colours;
}

/// What else a line may hold that begins with `key`.
unsigned extra_of(std::string_view key) {
  if (key == "vt") return texture_coordinates;
  if (key == "usemtl" || key == "mtllib") return materials;
  return key == "l" || key == "p" || key == "curv" || key == "curv2" || key == "surf" ? unsigned{curves} : 0U;
}

/// Gives every repeated corner of a face a point of its own, since OpenMesh takes repeated corners out of a face, which
/// turns a polygon that touches itself into another one.
void separate_repeats(PreparedMesh& mesh, std::vector<std::int64_t>& corners, std::size_t begin, std::size_t end) {
  std::vector<std::int64_t> seen(corners.begin() + begin, corners.begin() + end);
  std::sort(seen.begin(), seen.end());
  if (std::adjacent_find(seen.begin(), seen.end()) == seen.end()) return;
  std::vector<bool> met(seen.size(), false);
  for (std::size_t i = begin; i < end; ++i) {
    const auto place = std::lower_bound(seen.begin(), seen.end(), corners[i]) - seen.begin();
    if (met[place]) {
      mesh.twins.push_back(static_cast<std::uint32_t>(corners[i]));
      corners[i] = static_cast<std::int64_t>(mesh.points.size() + mesh.twins.size() - 1);
      mesh.stream += "v 0 0 0\n";
    }
    met[place] = true;
  }
}

/// Adds a face, with its normals if any are named.
void write_face(PreparedMesh& mesh, const Corners& corners, std::size_t begin, std::size_t end) {
  mesh.stream += 'f';
  for (std::size_t i = begin; i < end; ++i) {
    mesh.stream += fmt::format(" {}", corners.points[i] + 1);
    if (!corners.normals.empty())
      mesh.corner_normals.push_back(corners.normals[i] == none ? no_normal
                                                               : static_cast<std::uint32_t>(corners.normals[i]));
  }
  mesh.stream += '\n';
  ++mesh.faces;
}

}  // namespace

PreparedMesh prepare_obj(const std::string& bytes, const std::string& file) {
  const std::string text = join_lines(bytes);
  PreparedMesh mesh;
  mesh.stream.reserve(text.size());
  Corners corners;
  std::vector<Face> faces;
  Words words(text, '#');
  do {
    const std::string_view key = words.next_in_line();
    if (key == "v") {
      read_point(words, mesh, file);
    } else if (key == "vn") {
      mesh.normals.push_back(read_normal(words, file));
    } else if (key == "f") {
      faces.push_back({words.line(), corners.points.size()});
      read_corners(words, mesh.points.size(), mesh.normals.size(), corners, file);
    } else {
      mesh.extras |= extra_of(key);
    }
  } while (words.next_line());
  if (faces.empty()) refuse(file, "the OBJ file has no faces; choose a mesh");
  const auto points = static_cast<std::int64_t>(mesh.points.size());
  const auto normals = static_cast<std::int64_t>(mesh.normals.size());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const std::size_t begin = faces[f].begin, end = f + 1 < faces.size() ? faces[f + 1].begin : corners.points.size();
    for (std::size_t i = begin; i < end; ++i) {
      if (corners.points[i] >= points)
        refuse(file, faces[f].line,
               fmt::format("a face names point {}, but the file has {}; correct the index", corners.points[i] + 1,
                           points));
      if (corners.normal(i) >= normals)
        refuse(file, faces[f].line,
               fmt::format("a face names normal {}, but the file has {}; correct the index", corners.normal(i) + 1,
                           normals));
    }
    if (end - begin < 3) {
      mesh.drop_face("line", faces[f].line);
      continue;
    }
    separate_repeats(mesh, corners.points, begin, end);
    write_face(mesh, corners, begin, end);
  }
  // Normals that no face names: where there is one for each point, that is what they are.
  if (corners.normals.empty() && normals != points) {
    if (normals > 0) mesh.extras |= lone_normals;
    mesh.normals.clear();
  }
  return mesh;
}

}  // namespace parian
