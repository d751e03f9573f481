// Each warning once, with the file that it's about.
#include "session/warnings.hpp"

#include <algorithm>
#include <utility>

#include "core/words.hpp"

namespace parian {
namespace {

bool has(const std::vector<std::string>& all, const std::string& warning) {
  return std::find(all.begin(), all.end(), warning) != all.end();
}

}  // namespace

std::vector<std::string> note_warnings(std::vector<std::string>& all, const std::vector<std::string>& warnings) {
  std::vector<std::string> fresh;
  for (const std::string& warning : warnings) {
    if (has(all, warning)) continue;
    all.push_back(warning);
    fresh.push_back(warning);
  }
  return fresh;
}

Warnings::Warnings(std::vector<std::string> of_mesh, std::string mesh_file)
    : of_mesh_(std::move(of_mesh)), mesh_file_(std::move(mesh_file)) {}

std::vector<std::string> Warnings::add(const std::vector<std::string>& warnings) {
  std::vector<std::string> lines;
  for (const std::string& warning : warnings)
    lines.push_back(in_command_words(has(of_mesh_, warning) ? mesh_file_ + ": " + warning : warning));
  return note_warnings(all_, lines);
}

}  // namespace parian
