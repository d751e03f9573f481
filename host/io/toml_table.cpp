// Typed, checked reading of TOML tables.
#include "io/toml_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/error.hpp"
#include "core/nearest.hpp"
#include "io/foreign_file.hpp"

namespace parian {
namespace {

constexpr std::uintmax_t largest_file = 16u << 20;

const char* type_name(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return node.is_array_of_tables() ? "a list of tables" : "a list";
    case toml::node_type::string:
      return "text";
    case toml::node_type::integer:
      return "a whole number";
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "a truth value";
    default:
      return "a date or time";
  }
}

/// Lines of the parser's message joined to one.
std::string one_line(std::string_view text) {
  std::string line;
  for (const char c : text) line.push_back(c == '\n' || c == '\r' ? ' ' : c);
  return line;
}

}  // namespace

toml::table parse_toml_file(const std::string& file) {
  std::error_code failed;
  const auto status = std::filesystem::status(file, failed);
  if (!std::filesystem::exists(status)) {
    throw Error(ErrorKind::input, fmt::format("{}: there is no such file; check the path", file));
  }
  if (std::filesystem::is_directory(status)) {
    throw Error(ErrorKind::input, fmt::format("{}: is a folder; name a TOML file", file));
  }
  const std::uintmax_t bytes = std::filesystem::file_size(file, failed);
  if (!failed && bytes > largest_file) {
    throw Error(ErrorKind::input, fmt::format("{}: {} bytes are more than a scene can have ({}); "
                                              "is it another kind of file?",
                                              file, bytes, largest_file));
  }
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  if (stream.peek() != std::ifstream::traits_type::eof()) text << stream.rdbuf();
  if (!stream.is_open() || stream.bad()) {
    throw Error(ErrorKind::input, fmt::format("{}: can't be read; check its permissions", file));
  }
  try {
    return toml::parse(text.str(), file);
  } catch (const toml::parse_error& error) {
    if (const std::string kind = foreign_file(file); !kind.empty())
      throw Error(ErrorKind::input, fmt::format("{}: {}", file, kind));
    throw Error(ErrorKind::input, fmt::format("{}:{}: {}; correct the TOML", file, error.source().begin.line,
                                              one_line(error.description())));
  }
}

TomlTable::TomlTable(const toml::table& table, std::string file, std::string name)
    : table_(table), file_(std::move(file)), name_(std::move(name)) {}

std::string TomlTable::place(std::string_view key) const {
  const toml::node* node = key.empty() ? nullptr : table_.get(key);
  const auto line = node ? node->source().begin.line : table_.source().begin.line;
  return fmt::format("{}:{}", file_, line ? line : 1);
}

void TomlTable::fail(std::string_view key, const std::string& what) const {
  throw Error(ErrorKind::input, fmt::format("{}: {}", place(key), what));
}

const toml::node* TomlTable::ask(std::string_view key) {
  asked_.emplace_back(key);
  return table_.get(key);
}

double TomlTable::finite(const toml::node& node, std::string_view key, const char* wanted) const {
  const auto value = node.is_number() ? node.value<double>() : std::nullopt;
  if (!value) fail(key, fmt::format("{} is {}; give {}", key, type_name(node), wanted));
  if (!std::isfinite(*value)) fail(key, fmt::format("{} is {}; give a finite number", key, *value));
  return *value;
}

glm::dvec3 TomlTable::three(const toml::node& node, std::string_view key) const {
  const toml::array* list = node.as_array();
  if (!list) fail(key, fmt::format("{} is {}; give three numbers such as [1, 2, 3]", key, type_name(node)));
  if (list->size() != 3) {
    fail(key, fmt::format("{} has {} values; give three numbers such as [1, 2, 3]", key, list->size()));
  }
  glm::dvec3 result;
  for (int i = 0; i < 3; ++i) {
    result[i] = finite(*list->get(static_cast<std::size_t>(i)), key, "three numbers such as [1, 2, 3]");
  }
  return result;
}

std::optional<double> TomlTable::number(std::string_view key, const Interval& limit) {
  const toml::node* node = ask(key);
  if (!node) return std::nullopt;
  const double value = finite(*node, key, "a number");
  if (!limit.holds(value)) fail(key, fmt::format("{} = {} is out of range; give {}", key, value, limit.text()));
  return value;
}

std::optional<glm::dvec3> TomlTable::vector(std::string_view key) {
  const toml::node* node = ask(key);
  if (!node) return std::nullopt;
  return three(*node, key);
}

std::optional<glm::dvec3> TomlTable::vector_or_number(std::string_view key) {
  const toml::node* node = ask(key);
  if (!node) return std::nullopt;
  if (node->is_array()) return three(*node, key);
  return glm::dvec3(finite(*node, key, "a number or a list of three"));
}

std::optional<glm::uvec2> TomlTable::size(std::string_view key, std::uint32_t least, std::uint32_t most) {
  const toml::node* node = ask(key);
  if (!node) return std::nullopt;
  const toml::array* list = node->as_array();
  if (!list) fail(key, fmt::format("{} is {}; give two whole numbers such as [512, 512]", key, type_name(*node)));
  if (list->size() != 2) {
    fail(key, fmt::format("{} has {} values; give two whole numbers such as [512, 512]", key, list->size()));
  }
  glm::uvec2 result;
  for (int i = 0; i < 2; ++i) {
    const toml::node& item = *list->get(static_cast<std::size_t>(i));
    const auto value = item.as_integer();
    if (!value) fail(key, fmt::format("{} holds {}; give two whole numbers such as [512, 512]", key, type_name(item)));
    if (**value < least || **value > most) {
      fail(key, fmt::format("{} holds {}; give whole numbers from {} to {}", key, **value, least, most));
    }
    result[i] = static_cast<std::uint32_t>(**value);
  }
  return result;
}

std::optional<std::string> TomlTable::text(std::string_view key) {
  const toml::node* node = ask(key);
  if (!node) return std::nullopt;
  auto value = node->value_exact<std::string>();
  if (!value) fail(key, fmt::format("{} is {}; give text in quotes", key, type_name(*node)));
  if (value->empty()) fail(key, fmt::format("{} is empty; give text in quotes", key));
  return value;
}

std::vector<OptionValue> TomlTable::option_values(std::string_view key) {
  const toml::node* node = ask(key);
  if (!node) return {};
  std::vector<OptionValue> values;
  const auto add = [&](const toml::node& item) {
    if (item.is_number()) {
      values.emplace_back(finite(item, key, "a number"));
    } else if (const auto truth = item.value_exact<bool>()) {
      values.emplace_back(*truth);
    } else if (auto text = item.value_exact<std::string>()) {
      values.emplace_back(std::move(*text));
    } else {
      fail(key, fmt::format("{} is {}; give a number, text or true or false", key, type_name(item)));
    }
  };
  if (const toml::array* list = node->as_array()) {
    for (const toml::node& item : *list) add(item);
  } else {
    add(*node);
  }
  return values;
}

const toml::table* TomlTable::table(std::string_view key) {
  const toml::node* node = ask(key);
  if (!node) return nullptr;
  if (!node->is_table()) fail(key, fmt::format("{} is {}; write it as a table, [{}]", key, type_name(*node), key));
  return node->as_table();
}

std::vector<const toml::table*> TomlTable::tables(std::string_view key) {
  const toml::node* node = ask(key);
  if (!node) return {};
  const toml::array* list = node->as_array();
  if (!list || (!list->empty() && !list->is_array_of_tables())) {
    fail(key, fmt::format("{} is {}; write it with two brackets, [[{}]]", key, type_name(*node), key));
  }
  std::vector<const toml::table*> result;
  for (const toml::node& item : *list) result.push_back(item.as_table());
  return result;
}

void TomlTable::finish() const {
  for (auto&& [key, node] : table_) {
    const std::string name(key.str());
    if (std::find(asked_.begin(), asked_.end(), name) != asked_.end()) continue;
    const auto line = key.source().begin.line ? key.source().begin.line : node.source().begin.line;
    throw Error(ErrorKind::input,
                fmt::format("{}:{}: there is no key '{}'{}; {}", file_, line, name,
                            name_.empty() ? std::string() : " in " + name_, suggestion(name, asked_)));
  }
}

}  // namespace parian
