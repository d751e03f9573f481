// Files that appear whole or not at all: written beside their place under another name, then renamed.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>

namespace parian {

/// A file in the making. Write `temporary()`, then `commit`; without it the temporary is removed and whatever was at
/// the final place stays.
class WholeFile {
 public:
  /// Throws Error(output) as check_place does.
  explicit WholeFile(const std::filesystem::path& path);
  ~WholeFile();
  WholeFile(const WholeFile&) = delete;
  WholeFile& operator=(const WholeFile&) = delete;

  /// Where to write; in the same folder and with the same extension.
  [[nodiscard]] const std::filesystem::path& temporary() const { return temporary_; }
  /// Puts the file in its place. Throws Error(output).
  void commit();

 private:
  std::filesystem::path path_, target_, temporary_;
  bool committed_ = false;
};

/// Where a file called `path` lies, or will: links are followed, also one whose target isn't there yet. Throws
/// Error(output) if they lead in circles.
[[nodiscard]] std::filesystem::path final_place(const std::filesystem::path& path);

/// Throws Error(output) when no file can be put at `path`: no such folder, no permission, a name that is too long, or
/// something that isn't a file is there.
void check_place(const std::filesystem::path& path);

/// Writes `text` to `path`, whole or not at all. Throws Error(output).
void write_text(const std::filesystem::path& path, std::string_view text);

}  // namespace parian
