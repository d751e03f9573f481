// OFF: OpenMesh gets the header word, the counts, and per line one point or face, without comments and colours.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "mesh_prepare.hpp"

namespace parian {
namespace {

/// Takes `prefix` off the front of `word` if it is there.
bool take(std::string_view& word, std::string_view prefix) {
  if (!word.starts_with(prefix)) return false;
  word.remove_prefix(prefix.size());
  return true;
}

/// Whether OpenMesh, which looks at the start of the file alone, will expect normals behind the coordinates.
bool reader_expects_normals(std::string_view bytes) {
  take(bytes, "ST");
  take(bytes, "C");
  return take(bytes, "N");
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

/// Puts one face behind the stream; one of fewer than three corners is checked and left out.
void write_face(Words& words, std::uint64_t points, std::uint64_t left, PreparedMesh& mesh, const std::string& file) {
  std::string_view word = words.next();
  if (word.empty()) refuse(file, words.line(), "the file ends before its last face; it is truncated");
  const std::size_t begin = mesh.stream.size(), line = words.line();
  std::int64_t corners = 0;
  if (!parse_integer(word, corners) || corners < 0 || corners > static_cast<std::int64_t>(left))
    refuse(file, words.line(), fmt::format("'{:.40}' is not a possible number of corners; correct the face", word));
  mesh.stream += word;
  for (std::int64_t i = 0; i < corners; ++i) {
    word = words.next();
    std::int64_t index = 0;
    if (word.empty()) refuse(file, words.line(), "the file ends before its last face; it is truncated");
    if (!parse_integer(word, index) || index < 0 || static_cast<std::uint64_t>(index) >= points)
      refuse(file, words.line(),
             fmt::format("a face names point '{:.40}', but points are 0 to {}; correct the index", word, points - 1));
    mesh.stream += fmt::format(" {}", index);
  }
  mesh.stream += '\n';
  if (!words.next_in_line().empty()) mesh.extras |= face_colours;
  (void)words.next_line();
  if (corners >= 3) return;
  mesh.stream.resize(begin);
  mesh.drop_face("line", line);
}

/// Reads what stands behind a point's coordinates: a normal, a colour, a place in a texture.
void read_rest_of_point(Words& words, const Keyword& keyword, PreparedMesh& mesh, const std::string& file) {
  if (keyword.normals) {
    glm::dvec3 normal(std::numeric_limits<double>::quiet_NaN());
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view word = words.next_in_line();
      if (!word.empty() && !parse_number(word, normal[axis]))
        refuse(file, words.line(), fmt::format("'{:.40}' is not a number; correct the normal", word));
    }
    mesh.normals.emplace_back(normal);
  }
  if (!words.next_in_line().empty() && !keyword.textures) mesh.extras |= point_colours;
  (void)words.next_line();
}

PreparedMesh prepare_ascii(Words& words, const Keyword& keyword, std::string_view bytes, const std::string& file) {
  PreparedMesh mesh;
  const std::uint64_t points = read_count(words, file);
  const std::uint64_t faces = read_count(words, file);
  (void)words.next_in_line();  // edges, often missing
  check_counts(points, faces, 6, 2, bytes.size() - words.position(), file);
  if (keyword.colours) mesh.extras |= point_colours;
  if (keyword.textures) mesh.extras |= texture_coordinates;
  const bool expected = reader_expects_normals(bytes);
  constexpr std::size_t digits = 10;  // room for the count of faces, which isn't known yet
  mesh.stream = fmt::format("OFF\n{} ", points);
  const std::size_t count_at = mesh.stream.size();
  mesh.stream += std::string(digits, ' ') + " 0\n";
  mesh.stream.reserve(bytes.size() + 64);
  for (std::uint64_t i = 0; i < points; ++i) {
    glm::dvec3 point(0.0);
    for (int axis = 0; axis < 3; ++axis) {
      // Coordinates of one point share a line; the first may be lines away.
      const std::string_view word = axis == 0 ? words.next() : words.next_in_line();
      mesh.stream += read_coordinate(word, point[axis], file, words.line());
      mesh.stream += axis < 2 ? ' ' : '\n';
    }
    if (expected) mesh.stream.insert(mesh.stream.size() - 1, " 0 0 1");
    read_rest_of_point(words, keyword, mesh, file);
    mesh.points.push_back(point);
  }
  for (std::uint64_t i = 0; i < faces; ++i) write_face(words, points, bytes.size(), mesh, file);
  mesh.faces = faces - mesh.bad_faces;
  mesh.stream.replace(count_at, digits, fmt::format("{:>{}}", mesh.faces, digits));
  return mesh;
}

/// The body of a binary file as 32-bit words in the machine's order.
class Binary {
 public:
  Binary(std::string_view body, bool swap) : body_(body), swap_(swap) {}
  bool next(std::uint32_t& value) {
    if (body_.size() < 4) return false;
    std::memcpy(&value, body_.data(), 4);
    if (swap_) value = value >> 24 | (value >> 8 & 0xff00U) | (value << 8 & 0xff0000U) | value << 24;
    body_.remove_prefix(4);
    return true;
  }
  [[nodiscard]] std::size_t left() const { return body_.size(); }

 private:
  std::string_view body_;
  bool swap_;
};

void append(std::string& stream, std::uint32_t word) {
  stream.append({static_cast<char>(word & 0xffU), static_cast<char>(word >> 8 & 0xffU),
                 static_cast<char>(word >> 16 & 0xffU), static_cast<char>(word >> 24)});
}

/// Puts the faces behind the stream; those of fewer than three corners are checked and left out.
void write_faces(Binary& in, std::uint32_t points, std::uint32_t faces, bool geomview, PreparedMesh& mesh,
                 const std::string& file) {
  for (std::uint32_t i = 0; i < faces; ++i) {
    std::uint32_t corners = 0;
    if (!in.next(corners)) refuse(file, fmt::format("the file ends before face {}; it is truncated", i));
    if (corners > in.left() / 4)
      refuse(file, fmt::format("face {} has {} corners; the file is damaged or truncated", i, corners));
    const std::size_t begin = mesh.stream.size();
    append(mesh.stream, corners);
    for (std::uint32_t k = 0; k < corners; ++k) {
      std::uint32_t index = 0;
      (void)in.next(index);
      if (index >= points)
        refuse(file, fmt::format("face {} names point {}, but points are 0 to {}; correct it", i, index, points - 1));
      append(mesh.stream, index);
    }
    if (corners < 3) {
      mesh.stream.resize(begin);
      mesh.drop_face("face", i);
    }
    std::uint32_t colours = 0;
    if (!geomview) continue;
    if (!in.next(colours) || colours > in.left() / 4)
      refuse(file, fmt::format("face {}: bad count of colours; the file is damaged or truncated", i));
    if (colours > 0) mesh.extras |= face_colours;
    for (std::uint32_t skipped = 0; colours > 0; --colours) (void)in.next(skipped);
  }
}

/// Binary OFF has two dialects: Geomview's is big-endian and has a count of colours behind each face, OpenMesh's is
/// little-endian and has none. The counts tell them apart, since only one order can fit into the file.
PreparedMesh prepare_binary(std::string_view body, const std::string& file) {
  PreparedMesh mesh;
  std::uint32_t points = 0;
  std::uint32_t faces = 0;
  std::uint32_t edges = 0;
  bool geomview = false;
  Binary in(body, std::endian::native == std::endian::big);
  if (!in.next(points) || !in.next(faces) || !in.next(edges))
    refuse(file, "the file ends before its counts; it is truncated");
  if (12ULL * points + 4ULL * faces > in.left()) {
    in = Binary(body, std::endian::native != std::endian::big);
    (void)(in.next(points) && in.next(faces) && in.next(edges));
    geomview = true;
  }
  check_counts(points, faces, 12, 4, in.left(), file);
  mesh.stream = "OFF BINARY\n";
  const std::size_t count_at = mesh.stream.size() + 4;
  for (const std::uint32_t count : {points, faces, edges}) append(mesh.stream, count);
  for (std::uint32_t i = 0; i < points; ++i) {
    glm::dvec3 point(0.0);
    for (int axis = 0; axis < 3; ++axis) {
      std::uint32_t word = 0;
      (void)in.next(word);  // check_counts made sure
      append(mesh.stream, word);
      point[axis] = static_cast<double>(std::bit_cast<float>(word));
      if (const char* fault = coordinate_fault(point[axis]))
        refuse(file, fmt::format("point {}: coordinate is {}; remove the point", i, fault));
    }
    mesh.points.push_back(point);
  }
  write_faces(in, points, faces, geomview, mesh, file);
  mesh.faces = faces - mesh.bad_faces;
  std::string count;
  append(count, static_cast<std::uint32_t>(mesh.faces));
  mesh.stream.replace(count_at, count.size(), count);
  return mesh;
}

}  // namespace

PreparedMesh prepare_off(const std::string& bytes, const std::string& file) {
  Words words(bytes, '#');
  const std::string_view keyword = words.next();
  const Keyword holds = read_keyword(keyword, file, words.line());
  Words ahead = words;
  if (ahead.next_in_line() == "BINARY") {
    constexpr std::string_view start = "OFF BINARY";
    const std::size_t end = bytes.find('\n');
    if (!bytes.starts_with(start) || end == std::string::npos || end > start.size() + 1)
      refuse(file, 1, "a binary OFF file must begin with a line 'OFF BINARY' (no colours, no normals); convert to PLY");
    return prepare_binary(std::string_view(bytes).substr(end + 1), file);
  }
  return prepare_ascii(words, holds, bytes, file);
}

}  // namespace parian
