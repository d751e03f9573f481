// OFF, in ASCII and in two binary dialects.
#include <fmt/format.h>

#include <limits>

#include "io/mesh_reading.hpp"

namespace parian {
namespace {

/// Takes `prefix` off the front of `word` if it is there.
bool take(std::string_view& word, std::string_view prefix) {
  if (!word.starts_with(prefix)) return false;
  word.remove_prefix(prefix.size());
  return true;
}

/// What the header word says of the points.
struct Keyword {
  bool textures, colours, normals;
};

/// Reads the header word, which is [ST][C][N][4][n]OFF; 4 and n mean another dimension.
Keyword read_keyword(std::string_view word, const std::string& file, std::size_t line) {
  std::string_view rest = word;
  const bool textures = take(rest, "ST"), colours = take(rest, "C"), normals = take(rest, "N");
  const bool dimension = take(rest, "4") || take(rest, "n");
  if (rest != "OFF") refuse(file, line, "this isn't an OFF file, which begins with 'OFF'; convert it");
  if (dimension) refuse(file, line, fmt::format("'{}' isn't three-dimensional; convert it to OFF", word));
  return {textures, colours, normals};
}

std::uint64_t read_count(Words& words, const std::string& file) {
  const std::string_view word = words.next();
  std::int64_t value = 0;
  if (!parse_integer(word, value) || value < 0 || value > 0x7fffffff)
    refuse(file, words.line(),
           fmt::format("'{:.40}' is not a possible count; the line must read 'POINTS FACES EDGES'", word));
  return static_cast<std::uint64_t>(value);
}

/// Refuses counts that can't fit into what is left of the file.
void check_counts(std::uint64_t points, std::uint64_t faces, std::uint64_t point_bytes, std::uint64_t face_bytes,
                  std::uint64_t left, const std::string& file) {
  if (points == 0 || faces == 0) refuse(file, "the OFF file has no faces; choose a mesh");
  if (points * point_bytes + faces * face_bytes > left + 1)
    refuse(file, fmt::format("the header promises {} points and {} faces, but only {} bytes follow; the file is "
                             "damaged or truncated",
                             points, faces, left));
}

/// Reads a face and leaves the rest of its line out.
void read_face(Words& words, std::size_t left, MeshReading& reading, const std::string& file) {
  PolygonMesh& mesh = reading.mesh;
  std::string_view word = words.next();
  if (word.empty()) refuse(file, words.line(), "the file ends before its last face; it is truncated");
  const std::size_t begin = mesh.corners.size(), line = words.line(), points = mesh.points.size();
  std::int64_t corners = 0;
  if (!parse_integer(word, corners) || corners < 0 || corners > static_cast<std::int64_t>(left))
    refuse(file, words.line(), fmt::format("'{:.40}' is not a possible number of corners; correct the face", word));
  for (std::int64_t i = 0; i < corners; ++i) {
    word = words.next();
    std::int64_t index = 0;
    if (word.empty()) refuse(file, words.line(), "the file ends before its last face; it is truncated");
    if (!parse_integer(word, index) || index < 0 || static_cast<std::uint64_t>(index) >= points)
      refuse(file, words.line(),
             fmt::format("a face names point '{:.40}', but points are 0 to {}; correct the index", word, points - 1));
    mesh.corners.push_back(static_cast<std::uint32_t>(index));
  }
  reading.end_face(begin, "line", line);
  if (!words.next_in_line().empty()) reading.extras |= face_colours;
  (void)words.next_line();
}

/// Reads what stands behind a point's coordinates: a normal, a colour, a place in a texture.
void read_rest_of_point(Words& words, const Keyword& keyword, MeshReading& reading, const std::string& file) {
  if (keyword.normals) {
    glm::dvec3 normal(std::numeric_limits<double>::quiet_NaN());
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view word = words.next_in_line();
      if (!word.empty() && !parse_number(word, normal[axis]))
        refuse(file, words.line(), fmt::format("'{:.40}' is not a number; correct the normal", word));
    }
    reading.mesh.normals.emplace_back(normal);
  }
  if (!words.next_in_line().empty() && !keyword.textures) reading.extras |= point_colours;
  (void)words.next_line();
}

MeshReading read_ascii(Words& words, const Keyword& keyword, std::size_t size, const std::string& file) {
  MeshReading reading;
  const std::uint64_t points = read_count(words, file);
  const std::uint64_t faces = read_count(words, file);
  (void)words.next_in_line();  // edges, often missing
  check_counts(points, faces, 6, 2, size - words.position(), file);
  if (keyword.colours) reading.extras |= point_colours;
  if (keyword.textures) reading.extras |= texture_coordinates;
  reading.mesh.points.reserve(points);
  reading.mesh.face_sizes.reserve(faces);
  for (std::uint64_t i = 0; i < points; ++i) {
    glm::dvec3& point = reading.mesh.points.emplace_back();
    for (int axis = 0; axis < 3; ++axis) {
      // Coordinates of one point share a line; the first may be lines away.
      const std::string_view word = axis == 0 ? words.next() : words.next_in_line();
      point[axis] = read_coordinate<double>(word, file, words.line());
    }
    read_rest_of_point(words, keyword, reading, file);
  }
  for (std::uint64_t i = 0; i < faces; ++i) read_face(words, size, reading, file);
  return reading;
}

/// Reads face `i` of a binary file.
void read_face(Numbers& numbers, std::uint32_t i, bool geomview, MeshReading& reading, const std::string& file) {
  PolygonMesh& mesh = reading.mesh;
  if (numbers.left() < 4) refuse(file, fmt::format("the file ends before face {}; it is truncated", i));
  const auto corners = numbers.next<std::uint32_t>();
  if (corners > numbers.left() / 4)
    refuse(file, fmt::format("face {} has {} corners; the file is damaged or truncated", i, corners));
  const std::size_t begin = mesh.corners.size(), points = mesh.points.size();
  for (std::uint32_t k = 0; k < corners; ++k) {
    const std::uint32_t index = mesh.corners.emplace_back(numbers.next<std::uint32_t>());
    if (index >= points)
      refuse(file, fmt::format("face {} names point {}, but points are 0 to {}; correct it", i, index, points - 1));
  }
  reading.end_face(begin, "face", i);
  if (!geomview) return;
  const std::uint32_t colours = numbers.left() < 4 ? 0xffffffffU : numbers.next<std::uint32_t>();
  if (colours > numbers.left() / 4)
    refuse(file, fmt::format("face {}: bad count of colours; the file is damaged or truncated", i));
  if (colours > 0) reading.extras |= face_colours;
  numbers.skip(4 * std::size_t{colours});
}

/// Binary OFF has two dialects: Geomview's is big-endian and has a count of colours behind each face, OpenMesh's is
/// little-endian and has none. The counts tell them apart, since only one order can fit into the file.
MeshReading read_binary(std::string_view body, const std::string& file) {
  constexpr std::size_t counts = 12;  // bytes
  if (body.size() < counts) refuse(file, "the file ends before its counts; it is truncated");
  Numbers numbers(body, std::endian::little);
  auto points = numbers.next<std::uint32_t>(), faces = numbers.next<std::uint32_t>();
  const bool geomview = 12ULL * points + 4ULL * faces > body.size() - counts;
  if (geomview) {
    numbers = Numbers(body, std::endian::big);
    points = numbers.next<std::uint32_t>();
    faces = numbers.next<std::uint32_t>();
  }
  numbers.skip(4);  // the count of edges
  check_counts(points, faces, 12, 4, numbers.left(), file);
  MeshReading reading;
  reading.mesh.points.reserve(points);
  reading.mesh.face_sizes.reserve(faces);
  for (std::uint32_t i = 0; i < points; ++i) {
    glm::dvec3& point = reading.mesh.points.emplace_back();
    for (int axis = 0; axis < 3; ++axis) {
      point[axis] = static_cast<double>(numbers.next<float>());
      if (const char* fault = coordinate_fault(point[axis]))
        refuse(file, fmt::format("point {}: coordinate is {}; remove the point", i, fault));
    }
  }
  for (std::uint32_t i = 0; i < faces; ++i) read_face(numbers, i, geomview, reading, file);
  return reading;
}

}  // namespace

MeshReading read_off(std::string_view bytes, const std::string& file) {
  Words words(bytes, '#');
  const std::string_view keyword = words.next();
  const Keyword holds = read_keyword(keyword, file, words.line());
  Words ahead = words;
  if (ahead.next_in_line() != "BINARY") return read_ascii(words, holds, bytes.size(), file);
  constexpr std::string_view start = "OFF BINARY";
  const std::size_t end = bytes.find('\n');
  if (!bytes.starts_with(start) || end == std::string::npos || end > start.size() + 1)
    refuse(file, 1, "a binary OFF file must begin with a line 'OFF BINARY' (no colours, no normals); convert to PLY");
  return read_binary(bytes.substr(end + 1), file);
}

}  // namespace parian
