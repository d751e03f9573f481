// Where the command keeps compiled programs between runs.
#pragma once
#include <string>

namespace parian {

class Compute;

/// A folder that ProgramCache takes, "" for none, and why the one that was asked for isn't taken.
struct ProgramFolder {
  std::string path, doubt;
};

/// The one for a driver's programs, made if it isn't there: PARIAN_CACHE, where 0 means none; by default
/// parian/programs among the user's caches, for platforms that aren't known to keep programs themselves.
[[nodiscard]] ProgramFolder program_folder(const std::string& platform);

/// Has programs of `compute` kept there.
void keep_programs(Compute& compute);

}  // namespace parian
