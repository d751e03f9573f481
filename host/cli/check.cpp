// `parian check`: how far to trust the models.
#include <memory>

#include "commands.hpp"

namespace parian {

void add_check(CLI::App& app, Run& run) {
  CLI::App* command = app.add_subcommand("check", "how far to trust the models");
  const auto half_space = std::make_shared<bool>(false), json = std::make_shared<bool>(false);
  command
      ->add_flag("--half-space", *half_space,
                 "the models' own error: their albedo on a half-space beside a random walk's")
      ->required();
  command->add_flag("--json", *json, "as JSON");
  command->callback([&run, half_space, json] { run = [half_space, json] { return print_half_space(*json); }; });
}

}  // namespace parian
