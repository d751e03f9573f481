// Words, numbers, refusals and warnings, shared by the formats' readers.
#include "io/mesh_reading.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <locale>
#include <sstream>

#include "core/error.hpp"

namespace parian {
namespace {

bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r' && c != '\n'); }

/// Messages quote words of damaged files, which mustn't reach a terminal raw.
std::string printable(std::string message) {
  for (char& c : message)
    if (c < ' ' || c > '~') c = '?';
  return message;
}

}  // namespace

void refuse(const std::string& file, const std::string& message) {
  throw Error(ErrorKind::input, fmt::format("{}: {}", file, printable(message)));
}

void refuse(const std::string& file, std::size_t line, const std::string& message) {
  throw Error(ErrorKind::input, fmt::format("{}:{}: {}", file, line, printable(message)));
}

void MeshReading::drop_face(std::size_t begin, const char* unit, std::size_t number) {
  mesh.corners.resize(begin);
  if (bad_faces++ == 0) first_bad_face = fmt::format("{} {}", unit, number);
}

std::vector<std::string> MeshReading::warnings() const {
  std::vector<std::string> lines;
  if (bad_faces > 0)
    lines.push_back(fmt::format(
        "{} of fewer than three corners {} left out, the first in {}; mend the mesh if it has "
        "holes there",
        bad_faces == 1 ? "a face" : fmt::format("{} faces", bad_faces), bad_faces == 1 ? "is" : "are", first_bad_face));
  constexpr std::array<std::pair<Extra, const char*>, 6> names{{{point_colours, "vertex colours"},
                                                                {face_colours, "face colours"},
                                                                {texture_coordinates, "texture coordinates"},
                                                                {materials, "materials"},
                                                                {lone_normals, "some normals"},
                                                                {curves, "lines, points and curves"}}};
  std::vector<const char*> held;
  for (const auto& [bit, name] : names)
    if (extras & bit) held.push_back(name);
  if (!held.empty())
    lines.push_back(
        fmt::format("what else the file holds is left out ({}): an object has one material all over; "
                    "choose it with --material or in a scene",
                    fmt::join(held, ", ")));
  return lines;
}

/// How many bytes at the place where the reading stands join this line to the next.
std::size_t Words::join() const {
  if (!joins_ || text_[position_] != '\\') return 0;
  const std::string_view rest = text_.substr(position_ + 1, 2);
  return rest.starts_with('\n') ? 2 : rest == "\r\n" ? 3 : 0;
}

void Words::to_end_of_line() {
  while (position_ < text_.size() && text_[position_] != '\n') {
    const std::size_t bytes = join();
    joined_ += bytes > 0 ? 1 : 0;
    position_ += std::max<std::size_t>(bytes, 1);
  }
}

void Words::skip(bool over_lines) {
  while (position_ < text_.size()) {
    const char c = text_[position_];
    if (is_blank(c)) {
      ++position_;
    } else if (c == '\n') {
      if (!over_lines) return;
      next_line();
    } else if (comment_ != 0 && c == comment_) {
      to_end_of_line();
    } else if (const std::size_t bytes = join(); bytes > 0) {
      position_ += bytes;
      ++joined_;
    } else {
      return;
    }
  }
}

std::string_view Words::word() {
  const std::size_t begin = position_;
  while (position_ < text_.size()) {
    const char c = text_[position_];
    if (c == '\n' || is_blank(c) || (comment_ != 0 && c == comment_) || join() > 0) break;
    ++position_;
  }
  return text_.substr(begin, position_ - begin);
}

std::string_view Words::next() {
  skip(true);
  return word();
}

std::string_view Words::next_in_line() {
  skip(false);
  return word();
}

bool Words::next_line() {
  to_end_of_line();
  if (position_ == text_.size()) return false;
  ++position_;
  line_ += 1 + joined_;
  joined_ = 0;
  return true;
}

template <class Real>
bool parse_number(std::string_view word, Real& value) {
  if (word.size() > 1 && word.front() == '+' && word[1] != '-') word.remove_prefix(1);
  const char* end = word.data() + word.size();
  const auto [stop, fault] = std::from_chars(word.data(), end, value);
  if (stop != end || word.empty()) return false;
  if (fault == std::errc::result_out_of_range) {  // 0, or infinity
    std::istringstream stream{std::string(word)};
    stream.imbue(std::locale::classic());
    if (!(stream >> value) && value != 0) value = std::copysign(std::numeric_limits<Real>::infinity(), value);
  }
  return fault != std::errc::invalid_argument;
}
template bool parse_number(std::string_view word, float& value);
template bool parse_number(std::string_view word, double& value);

bool parse_integer(std::string_view word, std::int64_t& value) {
  if (word.size() > 1 && word.front() == '+' && word[1] != '-') word.remove_prefix(1);
  const char* end = word.data() + word.size();
  const auto [stop, fault] = std::from_chars(word.data(), end, value);
  return stop == end && !word.empty() && fault == std::errc();
}

const char* coordinate_fault(double value) {
  if (!std::isfinite(value)) return "not finite";
  if (std::abs(value) > std::numeric_limits<float>::max()) return "too large for single precision";
  return nullptr;
}

template <class Real>
Real read_coordinate(std::string_view word, const std::string& file, std::size_t line) {
  if (word.empty()) refuse(file, line, "a point has fewer than three coordinates; the file may be truncated");
  Real value = 0;
  if (!parse_number(word, value))
    refuse(file, line, fmt::format("'{:.40}' is not a number; correct the coordinate", word));
  if (std::abs(value) < std::numeric_limits<float>::max()) return value;
  double exact = 0.0;  // which a float may not be
  (void)parse_number(word, exact);
  if (const char* fault = coordinate_fault(exact))
    refuse(file, line, fmt::format("coordinate '{:.40}' is {}; remove the point or rescale the mesh", word, fault));
  return value;
}
template float read_coordinate(std::string_view word, const std::string& file, std::size_t line);
template double read_coordinate(std::string_view word, const std::string& file, std::size_t line);

}  // namespace parian
