// The options that say how well and how to render: one table for the command line's --names and a scene's [render].
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "scene/scene.hpp"

namespace parian {

/// The value of an option: true for a flag, a number, or text.
using OptionValue = std::variant<bool, double, std::string>;

/// One option; its default is what Settings starts with.
struct RenderOption {
  std::string name;    ///< as on the command line, without the leading dashes; [render] has '_' for '-'
  std::string values;  ///< what it takes, for help, such as "N" or "on|off"; empty for a flag
  std::string help;    ///< one clause
  bool repeatable = false;
  /// Sets the option; returns "" or what is wrong with the value and what to do, without the option's name.
  std::function<std::string(Settings&, const OptionValue&)> set;
  /// The value in `settings` as text.
  std::function<std::string(const Settings&)> text;
};

/// All of them, in the order in which help lists them.
[[nodiscard]] const std::vector<RenderOption>& render_options();

/// Checks settings against each other; returns "" or what is wrong and what to do.
[[nodiscard]] std::string conflict(const Settings& settings);

/// All settings as text, such as "error=0.001 frames=1024 …".
[[nodiscard]] std::string describe(const Settings& settings);

/// A finite number with nothing around it, '.' for the decimal point whatever the locale.
[[nodiscard]] std::optional<double> parse_number(std::string_view text);

}  // namespace parian
