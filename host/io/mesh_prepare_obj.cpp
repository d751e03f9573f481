// OBJ: OpenMesh gets the points and the faces' point indices; materials, textures and normals stay out.
#include <fmt/format.h>

#include <algorithm>

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

/// Reads the corners of one face, each "point/texture/normal" with one-based or negative indices.
void read_corners(Words& words, std::size_t points, std::vector<std::int64_t>& corners, const std::string& file) {
  const std::size_t begin = corners.size();
  for (std::string_view word = words.next_in_line(); !word.empty(); word = words.next_in_line()) {
    std::int64_t index = 0;
    if (!parse_integer(word.substr(0, word.find('/')), index) || index == 0)
      refuse(file, words.line(), fmt::format("'{:.40}' is not a corner of a face; points count from 1", word));
    if (index < 0) index += static_cast<std::int64_t>(points) + 1;
    if (index <= 0)
      refuse(file, words.line(),
             fmt::format("'{:.40}' reaches back before the first point; {} points stand above", word, points));
    corners.push_back(index - 1);
  }
  if (corners.size() - begin < 3)
    refuse(file, words.line(), fmt::format("a face has {} corners; remove it", corners.size() - begin));
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

}  // namespace

PreparedMesh prepare_obj(const std::string& bytes, const std::string& file) {
  const std::string text = join_lines(bytes);
  PreparedMesh mesh;
  mesh.stream.reserve(text.size());
  std::vector<std::int64_t> corners;
  std::vector<Face> faces;
  Words words(text, '#');
  do {
    const std::string_view key = words.next_in_line();
    if (key == "v") {
      glm::dvec3 point(0.0);
      mesh.stream += "v";
      for (int axis = 0; axis < 3; ++axis) {
        mesh.stream += ' ';
        mesh.stream += read_coordinate(words.next_in_line(), point[axis], file, words.line());
      }
      mesh.stream += '\n';
      mesh.points.push_back(point);
    } else if (key == "f") {
      faces.push_back({words.line(), corners.size()});
      read_corners(words, mesh.points.size(), corners, file);
    }
  } while (words.next_line());
  if (faces.empty()) refuse(file, "the OBJ file has no faces; choose a mesh");
  const auto points = static_cast<std::int64_t>(mesh.points.size());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const std::size_t end = f + 1 < faces.size() ? faces[f + 1].begin : corners.size();
    for (std::size_t i = faces[f].begin; i < end; ++i)
      if (corners[i] >= points)
        refuse(file, faces[f].line,
               fmt::format("a face names point {}, but the file has {}; correct the index", corners[i] + 1, points));
    separate_repeats(mesh, corners, faces[f].begin, end);
    mesh.stream += 'f';
    for (std::size_t i = faces[f].begin; i < end; ++i) mesh.stream += fmt::format(" {}", corners[i] + 1);
    mesh.stream += '\n';
  }
  mesh.faces = faces.size();
  return mesh;
}

}  // namespace parian
