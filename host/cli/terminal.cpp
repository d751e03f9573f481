// UTF-8, character by character, and the standard streams.
#include "cli/terminal.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>

#include "core/error.hpp"
#include "core/words.hpp"

namespace parian {
namespace {

constexpr std::uint32_t invalid = 0xffffffff;

struct Character {
  std::uint32_t code;
  std::size_t bytes;
};

/// The character that `text`, which isn't empty, begins with; a byte that begins none is an invalid one.
Character first_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  if (byte(0) < 0x80) return {byte(0), 1};
  const std::size_t bytes = byte(0) >= 0xf0 ? 4 : byte(0) >= 0xe0 ? 3 : 2;
  if (byte(0) < 0xc2 || byte(0) > 0xf4 || text.size() < bytes) return {invalid, 1};
  std::uint32_t code = byte(0) & (0x7fU >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return {invalid, 1};
    code = code << 6 | (byte(i) & 0x3fU);
  }
  constexpr std::array<std::uint32_t, 5> least{0, 0, 0x80, 0x800, 0x10000};  // shorter forms may hide a character
  const bool surrogate = code >= 0xd800 && code <= 0xdfff;
  return code < least[bytes] || code > 0x10ffff || surrogate ? Character{invalid, 1} : Character{code, bytes};
}

/// Whether a character acts on a terminal rather than showing.
bool acts(std::uint32_t code) {
  if (code < 0x20 || (code >= 0x7f && code <= 0x9f)) return true;
  if (code == 0x61c || code == 0x200e || code == 0x200f) return true;  // direction of writing
  return (code >= 0x2028 && code <= 0x202e) || (code >= 0x2066 && code <= 0x2069) || code == invalid;
}

}  // namespace

std::string printable(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const auto [code, bytes] = first_character(text);
    if (code == '\n' || code == '\r' || code == '\t')
      out += ' ';
    else if (acts(code))
      out += '?';
    else
      out += text.substr(0, bytes);
    text.remove_prefix(bytes);
  }
  return out;
}

void say(std::string_view line) {
  const std::string text = fmt::format("parian: {}\n", printable(in_command_words(std::string(line))));
  (void)std::fwrite(text.data(), 1, text.size(), stderr);
}

void show_text(std::string_view text) { (void)std::fwrite(text.data(), 1, text.size(), stdout); }

void flush_results() {
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
    throw Error(ErrorKind::output, "standard output could not be written; check where it goes");
}

void keep_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) != -1 || errno != EBADF) continue;
    // The lowest number that is free is this one. Open for reading only, so that results are still refused.
    (void)::open("/dev/null", stream == STDERR_FILENO ? O_WRONLY : O_RDONLY);
  }
}

}  // namespace parian
