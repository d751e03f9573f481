// What settings are called in messages: the core marks their names, and each front has its own words for them.
#pragma once
#include <string>
#include <string_view>

namespace parian {

/// The setting `name`, as parian_settings spells it, as a mark in a message; or one of: film (its size), gather_layers
/// (the choice of layers), with_device (how to choose a device, with a space before it; nothing where there is no way).
[[nodiscard]] std::string setting(std::string_view name);

/// A message as an embedder reads it: layer_size, views PARIAN_LAYERS.
[[nodiscard]] std::string in_api_words(const std::string& message);
/// As a user of the command line reads it: --layer-size, --gather layers.
[[nodiscard]] std::string in_command_words(const std::string& message);

}  // namespace parian
