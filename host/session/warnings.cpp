// Each warning once, with the file that it's about.
#include "warnings.hpp"

#include <algorithm>
#include <utility>

#include "words.hpp"

namespace parian {

Warnings::Warnings(std::vector<std::string> of_mesh, std::string mesh_file)
    : of_mesh_(std::move(of_mesh)), mesh_file_(std::move(mesh_file)) {}

std::vector<std::string> Warnings::add(const std::vector<std::string>& warnings) {
  const auto has = [](const std::vector<std::string>& all, const std::string& warning) {
    return std::find(all.begin(), all.end(), warning) != all.end();
  };
  std::vector<std::string> fresh;
  for (const std::string& warning : warnings) {
    const std::string line = in_command_words(has(of_mesh_, warning) ? mesh_file_ + ": " + warning : warning);
    if (has(all_, line)) continue;
    all_.push_back(line);
    fresh.push_back(line);
  }
  return fresh;
}

}  // namespace parian
