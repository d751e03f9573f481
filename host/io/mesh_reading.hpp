// What the readers of mesh files share: the polygons that they fill, the words and numbers of files, and refusals.
#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "scene/mesh.hpp"

namespace parian {

/// What files hold beside the surface and no picture shows, as bits.
enum Extra : unsigned {
  point_colours = 1,
  face_colours = 2,
  texture_coordinates = 4,
  materials = 8,
  lone_normals = 16,  ///< normals that belong to no corner, or not all three of their coordinates
  curves = 32,
};

/// A mesh while it is read, and what is left out of it.
struct MeshReading {
  PolygonMesh mesh;
  unsigned extras = 0;         ///< what else the file holds, bits of Extra
  std::size_t bad_faces = 0;   ///< left out for having fewer than three corners
  std::string first_bad_face;  ///< where the first of them is

  /// Makes a face of the corners from `begin` on; of fewer than three, it leaves them out. Unit and number say where
  /// the face is: "line" 7, "face" 12.
  void end_face(std::size_t begin, const char* unit, std::size_t number) {
    const std::size_t size = mesh.corners.size() - begin;
    if (size >= 3)
      mesh.face_sizes.push_back(static_cast<std::uint32_t>(size));
    else
      drop_face(begin, unit, number);
  }
  /// What reading left out, one line each.
  [[nodiscard]] std::vector<std::string> warnings() const;

 private:
  void drop_face(std::size_t begin, const char* unit, std::size_t number);
};

// The readers, one for each format. `file` is the name for messages. They throw Error(input).
[[nodiscard]] MeshReading read_ply(std::string_view bytes, const std::string& file);
[[nodiscard]] MeshReading read_obj(std::string_view bytes, const std::string& file);
[[nodiscard]] MeshReading read_off(std::string_view bytes, const std::string& file);
[[nodiscard]] MeshReading read_stl(std::string_view bytes, const std::string& file);
[[nodiscard]] MeshReading read_om(std::string_view bytes, const std::string& file);

/// Throws Error(input) "FILE: message".
[[noreturn]] void refuse(const std::string& file, const std::string& message);
/// Throws Error(input) "FILE:LINE: message".
[[noreturn]] void refuse(const std::string& file, std::size_t line, const std::string& message);

/// The words of a text, one after the other, with the number of the line each stands on.
class Words {
 public:
  /// `comment` starts a comment that ends with its line (0: none). Where `joins`, a backslash at the end of a line
  /// joins the next to it.
  explicit Words(std::string_view text, char comment = 0, bool joins = false, std::size_t line = 1)
      : text_(text), comment_(comment), joins_(joins), line_(line) {}
  /// The next word, or an empty view at the end of the text.
  [[nodiscard]] std::string_view next();
  /// The next word of this line, or an empty view at its end (which isn't passed).
  [[nodiscard]] std::string_view next_in_line();
  /// Leaves out the rest of this line; false at the end of the text.
  bool next_line();
  /// The line; of joined lines the first.
  [[nodiscard]] std::size_t line() const { return line_; }
  [[nodiscard]] std::size_t position() const { return position_; }

 private:
  [[nodiscard]] std::size_t join() const;
  void to_end_of_line();
  void skip(bool over_lines);
  std::string_view word();

  std::string_view text_;
  char comment_;
  bool joins_;
  std::size_t line_;
  std::size_t joined_ = 0;  // lines, since line_
  std::size_t position_ = 0;
};

/// The numbers of a binary file, one after the other.
class Numbers {
 public:
  Numbers(std::string_view bytes, std::endian order) : bytes_(bytes), swap_(order != std::endian::native) {}
  [[nodiscard]] std::size_t left() const { return bytes_.size(); }
  /// Steps over bytes, of which there must be as many left.
  void skip(std::size_t bytes) { bytes_.remove_prefix(bytes); }
  /// The next number, of whose bytes there must be as many left.
  template <class T>
  T next() {
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes_.data(), sizeof(T));
    if (swap_) std::reverse(raw.begin(), raw.end());
    bytes_.remove_prefix(sizeof(T));
    return std::bit_cast<T>(raw);
  }

 private:
  std::string_view bytes_;
  bool swap_;
};

/// Parses a whole word as a float or a double; a leading plus is allowed. False if it isn't one (nan and inf are).
template <class Real>
[[nodiscard]] bool parse_number(std::string_view word, Real& value);
/// Parses a whole word as an integer. False if it isn't one.
[[nodiscard]] bool parse_integer(std::string_view word, std::int64_t& value);
/// What is wrong with a coordinate, or nullptr: it must be finite and fit into single precision.
[[nodiscard]] const char* coordinate_fault(double value);
/// Reads a coordinate from a word, or refuses it.
template <class Real>
[[nodiscard]] Real read_coordinate(std::string_view word, const std::string& file, std::size_t line);

}  // namespace parian
