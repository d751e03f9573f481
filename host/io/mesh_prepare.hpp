// What OpenMesh's readers don't check is checked here first: each format's `prepare` walks the file once, refuses what
// is wrong by line, keeps the points in double, and writes the plain form of the file that OpenMesh reads right.
// OpenMesh 9 otherwise takes truncated files for whole ones, believes any count, reads coordinates as floats, skips
// bad vertices (which shifts every index), reads PLY lists of most types wrongly, and knows no comments in OFF.
#pragma once
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <string_view>
#include <vector>

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

/// A file in the form that goes to OpenMesh, and what must come back.
struct PreparedMesh {
  std::string stream;
  bool binary = false;               ///< STL: which of its two forms `stream` has
  std::vector<glm::dvec3> points;    ///< exact positions of the points that OpenMesh delivers; empty: take OpenMesh's
  std::size_t faces = 0;             ///< OpenMesh must deliver as many; STL: at most as many
  std::vector<std::uint32_t> twins;  ///< OBJ: point i of `points` is stream point i; stream point points.size()+j
                                     ///< stands for twins[j]
  std::vector<glm::vec3> normals{};  ///< as PolygonMesh has them
  std::vector<std::uint32_t> corner_normals{};
  unsigned extras = 0;         ///< what else the file holds, bits of Extra
  std::size_t bad_faces = 0;   ///< left out for having fewer than three corners
  std::string first_bad_face;  ///< where the first of them is

  /// Leaves a face out; `place` names it: "line 7", "face 12".
  void drop_face(const char* unit, std::size_t number);
  /// What reading left out, one line each.
  [[nodiscard]] std::vector<std::string> warnings() const;
};

[[nodiscard]] PreparedMesh prepare_ply(const std::string& bytes, const std::string& file);
[[nodiscard]] PreparedMesh prepare_obj(const std::string& bytes, const std::string& file);
[[nodiscard]] PreparedMesh prepare_off(const std::string& bytes, const std::string& file);
[[nodiscard]] PreparedMesh prepare_stl(const std::string& bytes, const std::string& file);
[[nodiscard]] PreparedMesh prepare_om(const std::string& bytes, const std::string& file);

/// Throws Error(input) "FILE: message".
[[noreturn]] void refuse(const std::string& file, const std::string& message);
/// Throws Error(input) "FILE:LINE: message".
[[noreturn]] void refuse(const std::string& file, std::size_t line, const std::string& message);

/// The words of a text, one after the other, with the number of the line each stands on.
class Words {
 public:
  /// `comment` starts a comment that ends with its line (0: none).
  explicit Words(std::string_view text, char comment = 0, std::size_t line = 1)
      : text_(text), comment_(comment), line_(line) {}
  /// The next word, or an empty view at the end of the text.
  [[nodiscard]] std::string_view next();
  /// The next word of this line, or an empty view at its end (which isn't passed).
  [[nodiscard]] std::string_view next_in_line();
  /// Leaves out the rest of this line; false at the end of the text.
  bool next_line();
  [[nodiscard]] std::size_t line() const { return line_; }
  [[nodiscard]] std::size_t position() const { return position_; }

 private:
  void skip(bool over_lines);
  std::string_view word();

  std::string_view text_;
  char comment_;
  std::size_t line_;
  std::size_t position_ = 0;
};

/// Parses a whole word as a number; a leading plus is allowed. False if it isn't one (nan and inf are numbers).
[[nodiscard]] bool parse_number(std::string_view word, double& value);
/// Parses a whole word as an integer. False if it isn't one.
[[nodiscard]] bool parse_integer(std::string_view word, std::int64_t& value);
/// What is wrong with a coordinate, or nullptr: it must be finite and fit into single precision.
[[nodiscard]] const char* coordinate_fault(double value);
/// Reads a coordinate from a word, or refuses it; returns the word.
std::string_view read_coordinate(std::string_view word, double& value, const std::string& file, std::size_t line);

}  // namespace parian
