// Compiled programs in a folder, for drivers that keep none themselves.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace parian {

/// A folder with a file for each program, which is believed only if it is whole and its key is the one asked for.
class ProgramCache {
 public:
  using Bytes = std::vector<unsigned char>;

  /// No folder: nothing is found, nothing is kept.
  ProgramCache() = default;
  /// Makes `folder` for this user alone if it isn't there. Throws Error(usage) if it can't be made, or is a folder that
  /// belongs to somebody else or that others may look into or write to.
  explicit ProgramCache(std::filesystem::path folder);

  /// What was kept under `key`; nothing where that isn't there, is damaged, or is another user's or key's.
  [[nodiscard]] std::optional<Bytes> find(const std::string& key) const;
  /// Keeps `binary` under `key`, and removes what hasn't been used for longest where the folder grows beyond its bound.
  /// Written beside and renamed, so that others find it whole or not at all. A cache that can't be written is none.
  void keep(const std::string& key, const Bytes& binary) const noexcept;
  /// Removes what is kept under `key`.
  void forget(const std::string& key) const noexcept;

  [[nodiscard]] explicit operator bool() const { return !folder_.empty(); }

 private:
  std::filesystem::path folder_;
};

}  // namespace parian
