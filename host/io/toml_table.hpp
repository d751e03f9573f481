// A strict view of one TOML table: typed values with ranges, and one clear line FILE:LINE for whatever is wrong.
#pragma once
#include <toml++/toml.h>

#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/render_options.hpp"
#include "scene/limits.hpp"

namespace parian {

/// Parses a TOML file of at most 16 MiB. Throws Error(input) with FILE:LINE.
[[nodiscard]] toml::table parse_toml_file(const std::string& file);

/// Reads the keys that a table may have. Ask for every key, then call `finish`: keys that nobody asked for are errors.
class TomlTable {
 public:
  /// `name` is how messages call the table, such as "[film]"; empty for the top of the file. `line` is where it starts.
  TomlTable(const toml::table& table, std::string file, std::string name);

  [[nodiscard]] std::optional<double> number(std::string_view key, const Interval& limit);
  [[nodiscard]] std::optional<glm::dvec3> vector(std::string_view key);
  /// Three numbers, or one number for all three.
  [[nodiscard]] std::optional<glm::dvec3> vector_or_number(std::string_view key);
  /// Two whole numbers from `least` to `most`.
  [[nodiscard]] std::optional<glm::uvec2> size(std::string_view key, std::uint32_t least, std::uint32_t most);
  [[nodiscard]] std::optional<std::string> text(std::string_view key);
  /// A number, text or truth value as render options take it, or a list of them; empty when the key is absent.
  [[nodiscard]] std::vector<OptionValue> option_values(std::string_view key);
  /// The table under `key`, or null.
  [[nodiscard]] const toml::table* table(std::string_view key);
  /// The tables of [[key]]; empty when the key is absent.
  [[nodiscard]] std::vector<const toml::table*> tables(std::string_view key);

  /// Throws for the first key that nobody asked for, with the nearest that somebody did.
  void finish() const;

  /// Whether the table has `key`; doesn't count as asking for it.
  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }
  /// "FILE:LINE" of a key, or of the table when it hasn't that key.
  [[nodiscard]] std::string place(std::string_view key = {}) const;
  /// Throws Error(input): "FILE:LINE: what".
  [[noreturn]] void fail(std::string_view key, const std::string& what) const;

 private:
  [[nodiscard]] const toml::node* ask(std::string_view key);
  [[nodiscard]] double finite(const toml::node& node, std::string_view key, const char* wanted) const;
  [[nodiscard]] glm::dvec3 three(const toml::node& node, std::string_view key) const;

  const toml::table& table_;
  std::string file_, name_;
  std::vector<std::string> asked_;
};

}  // namespace parian
