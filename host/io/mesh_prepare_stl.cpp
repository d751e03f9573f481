// STL: OpenMesh gets binary files as they are, and of ASCII files one facet after the other.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "ascii.hpp"
#include "mesh_prepare.hpp"

namespace parian {
namespace {

constexpr std::size_t header_size = 84;
constexpr std::size_t triangle_size = 50;

bool same(std::string_view word, std::string_view lower) {
  return std::equal(word.begin(), word.end(), lower.begin(), lower.end(),
                    [](char a, char b) { return ascii::lower(a) == b; });
}

std::uint32_t little_endian(const char* bytes) {
  std::uint32_t value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | static_cast<unsigned char>(bytes[i]);
  return value;
}

/// ASCII begins with "solid"; so do many binary headers, which are told by their exact size or by a zero byte.
bool is_ascii(const std::string& bytes) {
  Words words(bytes);
  if (!same(words.next(), "solid")) return false;
  if (bytes.size() < header_size) return true;
  if (header_size + triangle_size * std::uint64_t{little_endian(bytes.data() + 80)} == bytes.size()) return false;
  return std::find(bytes.begin(), bytes.end(), '\0') == bytes.end();
}

PreparedMesh prepare_binary(const std::string& bytes, const std::string& file) {
  if (bytes.size() < header_size) refuse(file, "this is neither an ASCII nor a binary STL file, or it is truncated");
  PreparedMesh mesh;
  mesh.binary = true;
  mesh.faces = little_endian(bytes.data() + 80);
  if (mesh.faces == 0) refuse(file, "the STL file has no triangles; choose a mesh");
  const std::uint64_t needed = header_size + triangle_size * std::uint64_t{mesh.faces};
  if (needed > bytes.size())
    refuse(file, fmt::format("the header promises {} triangles, which need {} bytes, but the file has {}; it is "
                             "damaged or truncated",
                             mesh.faces, needed, bytes.size()));
  for (std::size_t i = 0; i < mesh.faces; ++i)
    for (int k = 0; k < 9; ++k) {
      const std::uint32_t word = little_endian(bytes.data() + header_size + triangle_size * i + 12 + 4 * k);
      float value = 0.0F;
      std::memcpy(&value, &word, sizeof value);
      // A NaN would otherwise equal every point in OpenMesh's map of points.
      if (const char* fault = coordinate_fault(static_cast<double>(value)))
        refuse(file, fmt::format("triangle {}: a coordinate is {}; remove the triangle", i, fault));
    }
  // Colours of triangles: "COLOR=" in the header, or the highest bit of the two bytes behind each.
  bool coloured = bytes.substr(0, 80).find("COLOR=") != std::string::npos;
  for (std::size_t i = 0; i < mesh.faces && !coloured; ++i)
    coloured = (static_cast<unsigned char>(bytes[header_size + triangle_size * i + 49]) & 0x80U) != 0;
  if (coloured) mesh.extras |= face_colours;
  mesh.stream = bytes;
  return mesh;
}

PreparedMesh prepare_ascii(const std::string& bytes, const std::string& file) {
  PreparedMesh mesh;
  mesh.stream.reserve(bytes.size());
  Words words(bytes);
  int corners = -1;      // outside a loop
  std::size_t loop = 0;  // where it begins in the stream
  do {
    for (std::string_view word = words.next_in_line(); !word.empty(); word = words.next_in_line()) {
      if (same(word, "solid") || same(word, "endsolid")) {
        if (corners >= 0) refuse(file, words.line(), "a solid ends within a facet; the file is damaged");
        break;  // the rest is a name
      }
      if (same(word, "outer")) {
        if (corners >= 0) refuse(file, words.line(), "a facet begins within another; the file is damaged");
        corners = 0;
        loop = mesh.stream.size();
        mesh.stream += "outer loop\n";
      } else if (same(word, "vertex")) {
        if (corners < 0) refuse(file, words.line(), "a vertex outside 'outer loop'; the file is damaged");
        ++corners;
        mesh.stream += "vertex";
        for (int axis = 0; axis < 3; ++axis) {
          double value = 0.0;
          mesh.stream += ' ';
          mesh.stream += read_coordinate(words.next_in_line(), value, file, words.line());
        }
        mesh.stream += '\n';
      } else if (same(word, "endloop")) {
        if (corners > 3 || corners < 0)
          refuse(file, words.line(), "a facet doesn't have 3 vertices; convert the mesh to PLY or OBJ");
        if (corners < 3) {
          mesh.stream.resize(loop);
          mesh.drop_face("line", words.line());
        } else {
          ++mesh.faces;
        }
        corners = -1;
      }
    }
  } while (words.next_line());
  if (corners >= 0) refuse(file, words.line(), "the file ends within a facet; it is truncated");
  if (mesh.faces == 0) refuse(file, "the STL file has no triangles; choose a mesh");
  return mesh;
}

}  // namespace

PreparedMesh prepare_stl(const std::string& bytes, const std::string& file) {
  return is_ascii(bytes) ? prepare_ascii(bytes, file) : prepare_binary(bytes, file);
}

}  // namespace parian
