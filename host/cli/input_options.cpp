// The options about the input and the rendering: added to a subcommand, then parsed with one clear line per mistake.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>

#include "cli/commands.hpp"

namespace parian {
namespace {

[[noreturn]] void fail(const char* option, const std::string& text, const std::string& remedy) {
  throw Error(ErrorKind::usage, fmt::format("{}: '{}' isn't understood; give {}", option, text, remedy));
}

glm::dvec3 point(const std::vector<double>& numbers) { return {numbers[0], numbers[1], numbers[2]}; }

DirectionalLight parse_light(const std::string& text) {
  const std::size_t colon = text.find(':');
  const auto towards = parse_numbers(std::string_view(text).substr(0, colon), 3);
  DirectionalLight light;
  const char* remedy = "X,Y,Z or X,Y,Z:R,G,B, numbers only";
  if (!towards) fail("--light", text, remedy);
  light.towards = point(*towards);
  if (colon != std::string::npos) {
    const auto irradiance = parse_numbers(std::string_view(text).substr(colon + 1), 3);
    if (!irradiance) fail("--light", text, remedy);
    light.irradiance = point(*irradiance);
  }
  if (const auto problem = problem_of(light)) throw Error(ErrorKind::usage, "--light: " + problem->text());
  return light;
}

CameraChoice parse_camera(const std::string& text) {
  const std::size_t colon = text.find(':');
  const char* remedy = "EX,EY,EZ:TX,TY,TZ, the eye and what it looks at";
  if (colon == std::string::npos) fail("--camera", text, remedy);
  const auto eye = parse_numbers(std::string_view(text).substr(0, colon), 3);
  const auto target = parse_numbers(std::string_view(text).substr(colon + 1), 3);
  if (!eye || !target) fail("--camera", text, remedy);
  CameraChoice camera;
  camera.eye = point(*eye);
  camera.target = point(*target);
  camera.place = "--camera";
  return camera;
}

glm::uvec2 parse_size(const std::string& text) {
  const std::size_t cross = text.find_first_of("xX");
  const std::string remedy = fmt::format("WxH, whole numbers from 1 to {}", largest_film_side);
  if (cross == std::string::npos) fail("--size", text, remedy);
  const auto side = [&](const char* begin, const char* end) {
    std::uint32_t pixels = 0;
    const auto [stop, problem] = std::from_chars(begin, end, pixels);
    if (problem != std::errc() || stop != end || pixels < 1 || pixels > largest_film_side) {
      fail("--size", text, remedy);
    }
    return pixels;
  };
  const char* begin = text.data();
  return {side(begin, begin + cross), side(begin + cross + 1, begin + text.size())};
}

/// The settings named `only`, or all if that is empty.
void add_settings(CLI::App& app, InputOptions& options, const std::string& only) {
  const auto& table = render_options();
  options.settings.resize(table.size());
  options.flags.resize(table.size());
  const Settings defaults;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const RenderOption& option = table[i];
    if (!only.empty() && option.name != only) continue;
    const std::string name = "--" + option.name;
    CLI::Option* added = nullptr;
    if (option.values.empty()) {
      added = app.add_flag_callback(
          name, [&options, i] { options.flags[i] = 1; }, option.help);
    } else {
      const std::string help =
          option.repeatable ? option.help : fmt::format("{} ({})", option.help, option.text(defaults));
      added = add_texts(app, name, options.settings[i], option.values, help);
    }
    added->group(option.name == "keep" || option.name == "force" ? "Where and what to see" : "How well");
  }
}

void add_what(CLI::App& app, InputOptions& options) {
  app.add_option("INPUT", options.input, "a scene (.toml), or a mesh (.ply .obj .off .stl .om)")
      ->option_text(" ")
      ->required();
  const char* what = "What";
  const Camera camera;
  const Scene scene;
  add_text(app, "--material", options.material, "NAME", "'parian materials' lists them (marble)")->group(what);
  add_text(app, "--size-mm", options.size_mm, "X", "longest side of the object's box (100)")->group(what);
  add_texts(app, "--light", options.lights, "X,Y,Z[:R,G,B]",
            "direction towards a light, and its irradiance; repeatable, any replaces the default "
            "(0.5,0.6,-0.6:3.14159,3.14159,3.14159)")
      ->group(what);
  add_text(app, "--camera", options.camera, "EX,EY,EZ:TX,TY,TZ",
           "eye and target in mm (from direction 0.2,0.15,1 such that the object fits)")
      ->group(what);
  add_text(app, "--fov", options.fov, "DEG", fmt::format("full vertical angle ({})", camera.fov))->group(what);
  add_text(app, "--size", options.size, "WxH", fmt::format("pixels ({}x{})", scene.film.x, scene.film.y))->group(what);
}

}  // namespace

double parse_in_range(const char* option, const std::string& text, const Interval& limit) {
  const auto value = parse_number(text);
  if (!value) fail(option, text, limit.text());
  if (!limit.holds(*value))
    throw Error(ErrorKind::usage, fmt::format("{}: {} is out of range; give {}", option, text, limit.text()));
  return *value;
}

std::uint32_t parse_whole(const char* option, const std::string& text, std::uint32_t least, std::uint32_t most) {
  const double value = parse_in_range(option, text, {double(least), double(most)});
  if (value != std::floor(value))
    throw Error(ErrorKind::usage, fmt::format("{}: {} is not a whole number; give one", option, text));
  return static_cast<std::uint32_t>(value);
}

CLI::Option* add_text(CLI::App& app, const std::string& name, std::string& value, const std::string& values,
                      const std::string& help) {
  return app.add_option(name, value, help)->option_text(values)->take_last();
}

CLI::Option* add_texts(CLI::App& app, const std::string& name, std::vector<std::string>& values,
                       const std::string& type, const std::string& help) {
  return app
      .add_option_function<std::string>(
          name, [&values](const std::string& text) { values.push_back(text); }, help)
      ->option_text(type)
      ->take_all()
      ->trigger_on_parse();
}

std::optional<std::vector<double>> parse_numbers(std::string_view text, std::size_t count) {
  std::vector<double> numbers;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    const auto number = parse_number(text.substr(begin, comma - begin));
    if (!number) return std::nullopt;
    numbers.push_back(*number);
    begin = comma + 1;
  }
  if (numbers.size() != count) return std::nullopt;
  return numbers;
}

void add_scene_options(CLI::App& app, InputOptions& options) {
  add_what(app, options);
  add_settings(app, options, "model");
}

void add_input_options(CLI::App& app, InputOptions& options) {
  add_what(app, options);
  add_text(app, "--cameras", options.cameras, "FILE", "TOML with [[camera]] tables; then -o name_%03d.exr, from 0")
      ->group("What");
  add_settings(app, options, "");
  add_text(app, "--device", options.device, "N|SUBSTRING", "number or part of the name; also PARIAN_DEVICE (the best)")
      ->group("Where and what to see");
}

Overrides InputOptions::overrides() const {
  Overrides result;
  if (!material.empty()) result.material = material;
  if (!size_mm.empty()) result.size_mm = parse_in_range("--size-mm", size_mm, length_limit);
  for (const std::string& light : lights) result.lights.push_back(parse_light(light));
  if (!camera.empty()) result.camera = parse_camera(camera);
  if (!fov.empty()) result.fov = parse_in_range("--fov", fov, fov_limit);
  if (!size.empty()) result.film = parse_size(size);
  if (!cameras.empty()) result.cameras = cameras;
  if (result.camera && result.cameras) {
    throw Error(ErrorKind::usage, "--camera and --cameras are both given; keep one of them");
  }
  const auto& table = render_options();
  Settings scratch;
  for (std::size_t i = 0; i < table.size(); ++i) {
    std::vector<OptionValue> values;
    if (flags[i]) values.emplace_back(true);
    for (const std::string& text : settings[i]) {
      const auto number = table[i].repeatable ? std::nullopt : parse_number(text);
      values.push_back(number ? OptionValue(*number) : OptionValue(text));
    }
    for (const OptionValue& value : values) {
      const std::string problem = table[i].set(scratch, value);
      if (!problem.empty()) throw Error(ErrorKind::usage, fmt::format("--{}: {}", table[i].name, problem));
      result.settings.emplace_back(&table[i], value);
    }
  }
  return result;
}

void note_inputs(const Input& input, FileUses& files) {
  for (const auto& [as, path] : input.files) files.reads(as, path);
}

std::string InputOptions::device_selector(const std::string& scene) const {
  if (!device.empty()) return device;
  const char* environment = std::getenv("PARIAN_DEVICE");
  return environment && *environment ? environment : scene;
}

}  // namespace parian
