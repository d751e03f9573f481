// What a render warns of, collected.
#pragma once
#include <string>
#include <vector>

namespace parian {

/// Adds to `all` what it lacks of `warnings`; returns that.
std::vector<std::string> note_warnings(std::vector<std::string>& all, const std::vector<std::string>& warnings);

/// Warnings, each once, in the order in which they came.
class Warnings {
 public:
  Warnings() = default;
  /// Those of the mesh get its file's name, whoever passes them on.
  Warnings(std::vector<std::string> of_mesh, std::string mesh_file);

  /// Takes `warnings`; returns those that are new, as users of the command read them.
  std::vector<std::string> add(const std::vector<std::string>& warnings);
  [[nodiscard]] const std::vector<std::string>& all() const { return all_; }

 private:
  std::vector<std::string> of_mesh_, all_;
  std::string mesh_file_;
};

}  // namespace parian
