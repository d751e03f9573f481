// The subcommands: each adds itself to the command line and says what to run when it's chosen.
#pragma once
#include <CLI/CLI.hpp>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/file_uses.hpp"
#include "io/scene_file.hpp"
#include "scene/limits.hpp"

namespace parian {

/// What the chosen subcommand does; returns the exit code.
using Run = std::function<int()>;

void add_render(CLI::App& app, Run& run);
void add_reference(CLI::App& app, Run& run);
void add_compare(CLI::App& app, Run& run);
void add_devices(CLI::App& app, Run& run);
void add_materials(CLI::App& app, Run& run);
void add_report(CLI::App& app, Run& run);
void add_check(CLI::App& app, Run& run);
void add_bench(CLI::App& app, Run& run);

/// Each dipole model's albedo on half-spaces beside a random walk's, as a table or as JSON, on standard output; takes
/// some ten seconds. Returns the exit code.
[[nodiscard]] int print_half_space(bool json);

/// The options that name the input and say how to render it, as the user wrote them; several subcommands have them.
struct InputOptions {
  std::string input, material, size_mm, camera, fov, size, cameras, device;
  std::vector<std::string> lights;
  std::vector<std::vector<std::string>> settings;  ///< by the order of render_options()
  std::vector<char> flags;                         ///< likewise

  /// Parsed and checked. Throws Error(usage).
  [[nodiscard]] Overrides overrides() const;
  /// --device, else PARIAN_DEVICE, else `scene`'s.
  [[nodiscard]] std::string device_selector(const std::string& scene) const;
};

/// Notes what `input` was read from. Throws Error(usage) if something else is written there.
void note_inputs(const Input& input, FileUses& files);

/// Adds INPUT and the options of InputOptions; `options` must outlive `app`.
void add_input_options(CLI::App& app, InputOptions& options);

/// The same for what needs neither device nor passes: one camera, and of the settings only the model.
void add_scene_options(CLI::App& app, InputOptions& options);

/// Adds an option that takes one text; the last one counts when it's repeated.
CLI::Option* add_text(CLI::App& app, const std::string& name, std::string& value, const std::string& values,
                      const std::string& help);

/// Adds an option that takes one text and may be repeated.
CLI::Option* add_texts(CLI::App& app, const std::string& name, std::vector<std::string>& values,
                       const std::string& type, const std::string& help);

/// The number that the value of `option` is. Throws Error(usage) when it isn't one in `limit`.
[[nodiscard]] double parse_in_range(const char* option, const std::string& text, const Interval& limit);

/// The whole number that it is. Throws Error(usage) when it isn't one from `least` to `most`.
[[nodiscard]] std::uint32_t parse_whole(const char* option, const std::string& text, std::uint32_t least,
                                        std::uint32_t most);

/// Numbers separated by commas, exactly `count` of them; empty when `text` isn't that.
[[nodiscard]] std::optional<std::vector<double>> parse_numbers(std::string_view text, std::size_t count);

}  // namespace parian
