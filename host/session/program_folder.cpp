// The environment's word on compiled programs.
#include "session/program_folder.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <string_view>

#include "core/compute.hpp"

namespace parian {
namespace {

/// What has a cache of its own, which is at least as good: it holds what is compiled at the first launch, too.
constexpr std::array<std::string_view, 3> keep_their_own{"Portable Computing Language", "rusticl", "NVIDIA CUDA"};

/// "" where nothing says where the user's caches are.
std::filesystem::path user_caches() {
  // As the XDG base directory specification has it, where relative paths don't count.
  if (const char* caches = std::getenv("XDG_CACHE_HOME"); caches && *caches == '/') return caches;
  if (const char* home = std::getenv("HOME"); home && *home == '/') return std::filesystem::path(home) / ".cache";
  return {};
}

}  // namespace

ProgramFolder program_folder(const std::string& platform) {
  const char* wanted = std::getenv("PARIAN_CACHE");
  const bool named = wanted && *wanted;
  if (named && std::string_view(wanted) == "0") return {};
  std::filesystem::path folder;
  if (named)
    folder = wanted;
  else if (std::find(keep_their_own.begin(), keep_their_own.end(), platform) == keep_their_own.end())
    folder = user_caches();
  if (folder.empty()) return {};
  if (!named) folder = folder / "parian" / "programs";
  try {
    (void)ProgramCache(folder);
    return {folder.string(), ""};
  } catch (const Error& error) {
    return {"", named ? "PARIAN_CACHE: " + std::string(error.what()) : ""};
  }
}

void keep_programs(Compute& compute) {
  if (const ProgramFolder folder = program_folder(compute.info().platform); !folder.path.empty())
    compute.use_cache(ProgramCache(folder.path));
}

}  // namespace parian
