// The table of render options: names, ranges and what they set.
#include "io/render_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "scene/limits.hpp"

namespace parian {
namespace {

/// The value as a number, or what is wrong with it in `problem`.
double number_of(const OptionValue& value, std::string& problem) {
  if (const double* number = std::get_if<double>(&value)) return *number;
  const std::string* text = std::get_if<std::string>(&value);
  problem = text ? fmt::format("'{}' is not a number; give a number", *text)
                 : std::string("a truth value is not a number; give a number");
  return 0;
}

/// The row of a table of limits that is about `member`.
template <class Table, class Member>
const auto& limit_of(const Table& table, Member member) {
  return *std::find_if(table.begin(), table.end(), [=](const auto& row) { return row.member == member; });
}

RenderOption number(std::string name, std::string values, std::string help, double Settings::*member) {
  const Interval limit = limit_of(number_settings, member).limit;
  RenderOption option{std::move(name), std::move(values), std::move(help), false, {}, {}};
  option.set = [=](Settings& settings, const OptionValue& value) {
    std::string problem;
    const double x = number_of(value, problem);
    if (!problem.empty()) return problem;
    if (!limit.holds(x)) return fmt::format("{} is out of range; give {}", x, limit.text());
    settings.*member = x;
    return std::string();
  };
  option.text = [=](const Settings& settings) { return fmt::format("{}", settings.*member); };
  return option;
}

RenderOption whole(std::string name, std::string help, std::uint32_t Settings::*member) {
  const WholeSetting limit = limit_of(whole_settings, member);
  RenderOption option{std::move(name), "N", std::move(help), false, {}, {}};
  option.set = [=](Settings& settings, const OptionValue& value) {
    std::string problem;
    const double x = number_of(value, problem);
    if (!problem.empty()) return problem;
    if (!limit.holds(x)) return fmt::format("{} is not {}; give one", x, limit.text());
    settings.*member = static_cast<std::uint32_t>(x);
    return std::string();
  };
  option.text = [=](const Settings& settings) { return fmt::format("{}", settings.*member); };
  return option;
}

/// One of `names`, which are the enumerators in order.
template <typename Enum>
RenderOption choice(std::string name, std::string help, Enum Settings::*member, std::vector<std::string> names) {
  RenderOption option{std::move(name), fmt::format("{}", fmt::join(names, "|")), std::move(help), false, {}, {}};
  option.set = [=](Settings& settings, const OptionValue& value) {
    const std::string* text = std::get_if<std::string>(&value);
    for (std::size_t i = 0; text && i < names.size(); ++i) {
      if (*text == names[i]) {
        settings.*member = static_cast<Enum>(i);
        return std::string();
      }
    }
    const std::string given = text ? fmt::format("'{}'", *text) : std::string("the value");
    return fmt::format("{} is none of the choices; give one of: {}", given, fmt::join(names, ", "));
  };
  option.text = [=](const Settings& settings) { return names[static_cast<std::size_t>(settings.*member)]; };
  return option;
}

/// on|off, true|false in a scene.
RenderOption on_off(std::string name, std::string help, bool Settings::*member) {
  RenderOption option{std::move(name), "on|off", std::move(help), false, {}, {}};
  option.set = [=](Settings& settings, const OptionValue& value) {
    const bool* truth = std::get_if<bool>(&value);
    const std::string* text = std::get_if<std::string>(&value);
    if (!truth && !(text && (*text == "on" || *text == "off"))) {
      return std::string("the value is neither on nor off; give on or off");
    }
    settings.*member = truth ? *truth : *text == "on";
    return std::string();
  };
  option.text = [=](const Settings& settings) { return std::string(settings.*member ? "on" : "off"); };
  return option;
}

/// A flag that sets `member` to `meaning`.
RenderOption flag(std::string name, std::string help, bool Settings::*member, bool meaning) {
  RenderOption option{std::move(name), "", std::move(help), false, {}, {}};
  option.set = [=](Settings& settings, const OptionValue& value) {
    const bool* truth = std::get_if<bool>(&value);
    if (!truth) return std::string("the value is neither true nor false; give true or false");
    settings.*member = *truth ? meaning : !meaning;
    return std::string();
  };
  option.text = [=](const Settings& settings) { return std::string(settings.*member == meaning ? "on" : "off"); };
  return option;
}

RenderOption keep() {
  RenderOption option{"keep",
                      "NAME|all",
                      fmt::format("do this although the scene doesn't need it: {}", fmt::join(omission_names, ", ")),
                      true,
                      {},
                      {}};
  option.set = [](Settings& settings, const OptionValue& value) {
    const std::string* text = std::get_if<std::string>(&value);
    if (!text || text->empty())
      return std::string("the value is not a name; give a name that --explain prints, or all");
    settings.keep.insert(*text);
    return std::string();
  };
  option.text = [](const Settings& settings) {
    return settings.keep.empty() ? std::string("none") : fmt::format("{}", fmt::join(settings.keep, ","));
  };
  return option;
}

std::vector<RenderOption> make_options() {
  return {
      number("error", "E", "stop when the estimated relMSE is below E twice; 0: never", &Settings::error),
      whole("frames", "stop after N frames", &Settings::frames),
      number("time", "S", "stop after S seconds from the first frame; 0: no limit", &Settings::time),
      whole("layers", "directions from which the surface is stored", &Settings::layers),
      whole("layer-size", "texels along a layer's side", &Settings::layer_size),
      whole("light-map-size", "texels along a light map's side", &Settings::light_map_size),
      on_off("light-map-shift", "shift the light map's grid now and then", &Settings::light_map_shift),
      whole("samples", "samples per texel and frame, shared by the lights, at least two each; even",
            &Settings::samples),
      choice("model", "the dipole", &Settings::model, {model_names.begin(), model_names.end()}),
      choice("estimator", "how places on the light map are drawn", &Settings::estimator, {"auto", "radial", "disc"}),
      number("disc-radius", "MM", "the disc's radius, with --estimator disc; 0: from the material",
             &Settings::disc_radius),
      choice("gather",
             "layers, or the cameras' own views alone; auto: these while they have neither larger texels nor more",
             &Settings::gather, {"auto", "layers", "camera"}),
      flag("no-pyramids", "don't blur early frames", &Settings::pyramids, false),
      whole("seed", "another seed, another noise", &Settings::seed),
      keep(),
      flag("force", "render even if the device's memory seems too small or it fails its self-test", &Settings::force,
           true),
  };
}

}  // namespace

const std::vector<RenderOption>& render_options() {
  static const std::vector<RenderOption> options = make_options();
  return options;
}

std::string conflict(const Settings& settings) {
  if (settings.disc_radius > 0 && settings.estimator != Estimator::disc) {
    return "the disc's radius is given but another estimator is chosen; choose the estimator disc, or drop the radius";
  }
  return {};
}

std::string describe(const Settings& settings) {
  std::string all;
  for (const RenderOption& option : render_options()) {
    if (!all.empty()) all += ' ';
    all += option.name + '=' + option.text(settings);
  }
  return all;
}

std::optional<double> parse_number(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (problem != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace parian
