// The files that a command reads and writes: none may replace another.
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace parian {

/// Tells files apart by what they are, not by their names: links, "./x" and "x", and two names of one file are the
/// same.
class FileUses {
 public:
  /// Standard output and standard error are written from the start, where they are files.
  FileUses();

  /// A file that is read; `as` is what messages call it, such as "the mesh". Throws Error(usage) if it is written.
  void reads(const std::string& as, const std::filesystem::path& path);
  /// A file that will be written, whether it is there or not. Throws Error(usage) if it is read or written already.
  void writes(const std::string& as, const std::filesystem::path& path);

 private:
  /// Of a file that isn't there: its folder's, and its name.
  struct Identity {
    dev_t device = 0;
    ino_t inode = 0;
    std::string name;
    bool operator==(const Identity&) const = default;
  };
  struct Use {
    Identity identity;
    std::string as;
    bool written = false;
  };

  [[nodiscard]] static std::optional<Identity> identify(const std::filesystem::path& path);
  void add(const std::string& as, const std::filesystem::path& path, bool written);

  std::vector<Use> uses_;
};

}  // namespace parian
