// What the command prints: results on standard output, lines on standard error, and names of others made harmless.
#pragma once
#include <fmt/format.h>

#include <string>
#include <string_view>
#include <type_traits>

namespace parian {

/// Text as a terminal may have it, in one line: line breaks and tabs become spaces; other control characters, marks
/// that turn the direction of writing, and what isn't UTF-8 become '?'.
[[nodiscard]] std::string printable(std::string_view text);

/// Prints "parian: LINE" on standard error, with options for the settings that it marks, made printable. Never fails:
/// there is nowhere left to say so.
void say(std::string_view line);

/// Prints results as they are, which callers vouch for. What is lost shows in flush_results().
void show_text(std::string_view text);

/// `value` as results show it: printable, if it is text.
template <class T>
[[nodiscard]] decltype(auto) shown(const T& value) {
  if constexpr (std::is_convertible_v<const T&, std::string_view>)
    return printable(value);
  else
    return (value);
}

/// Prints results: `format` as it is, and text among `values` made printable.
template <class... T>
void show(fmt::format_string<T...> format, const T&... values) {
  // By name, as {fmt} from version 10 on takes no others.
  const auto show_all = [&](const auto&... all) { show_text(fmt::vformat(format, fmt::make_format_args(all...))); };
  show_all(shown(values)...);
}

/// Sends off what was shown. Throws Error(output) if any of it, now or before, could not be written.
void flush_results();

/// Gives standard streams that the caller closed something to stand for them, so that no file takes their place.
void keep_standard_streams();

}  // namespace parian
