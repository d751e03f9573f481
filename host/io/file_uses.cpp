// Device and inode, of files or of the folders that they will be in.
#include "io/file_uses.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <utility>

#include "core/error.hpp"
#include "io/whole_file.hpp"

namespace parian {

FileUses::FileUses() {
  for (const auto& [stream, name] :
       {std::pair{STDOUT_FILENO, "standard output"}, std::pair{STDERR_FILENO, "standard error"}}) {
    struct stat found {};
    if (::fstat(stream, &found) == 0 && S_ISREG(found.st_mode))
      uses_.push_back({{found.st_dev, found.st_ino, {}}, name, true});
  }
}

std::optional<FileUses::Identity> FileUses::identify(const std::filesystem::path& path) {
  struct stat found {};
  if (::stat(path.c_str(), &found) == 0) return Identity{found.st_dev, found.st_ino, {}};
  const std::filesystem::path place = final_place(path);
  const std::filesystem::path folder = place.has_parent_path() ? place.parent_path() : ".";
  if (::stat(folder.c_str(), &found) != 0) return std::nullopt;  // whoever opens it says so
  return Identity{found.st_dev, found.st_ino, place.filename().string()};
}

void FileUses::add(const std::string& as, const std::filesystem::path& path, bool written) {
  const auto identity = identify(path);
  if (!identity) return;
  for (const Use& use : uses_)
    if (use.identity == *identity && (use.written || written))
      throw Error(ErrorKind::usage, fmt::format("{}: {} and {} are the same file; give another name", path.string(),
                                                use.as == as ? "another " + as : use.as, as));
  uses_.push_back({*identity, as, written});
}

void FileUses::reads(const std::string& as, const std::filesystem::path& path) { add(as, path, false); }

void FileUses::writes(const std::string& as, const std::filesystem::path& path) { add(as, path, true); }

}  // namespace parian
