// Files of compiled programs: how they are written, and when they are believed.
#include "core/program_cache.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <random>
#include <utility>

#include "core/error.hpp"

#ifndef _WIN32
#include <sys/stat.h>
#include <unistd.h>
#endif

namespace parian {
namespace {

namespace fs = std::filesystem;
using Bytes = ProgramCache::Bytes;

constexpr std::uint64_t magic = 0x31676f7270726170;  // "parprog1"
constexpr std::uintmax_t most_bytes = 256U << 20;    // of all files: some hundred programs
constexpr const char* extension = ".program";

/// What a file begins with; key and binary follow.
struct Head {
  std::uint64_t magic, key_bytes, binary_bytes, checksum;
};

/// FNV-1a: against accidents. What others could change isn't read at all.
template <class Text>
std::uint64_t checksum_of(const Text& text, std::uint64_t hash = 14695981039346656037U) {
  for (const auto c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
  return hash;
}

Head head_of(const std::string& key, const Bytes& binary) {
  return {magic, key.size(), binary.size(), checksum_of(binary, checksum_of(key))};
}

fs::path file_of(const fs::path& folder, const std::string& key) {
  std::array<char, 17> name{};
  std::snprintf(name.data(), name.size(), "%016llx", static_cast<unsigned long long>(checksum_of(key)));
  return folder / (name.data() + std::string(extension));
}

#ifdef _WIN32
void make_private(const fs::path& folder) { fs::create_directories(folder); }
bool is_private(const fs::path&) { return true; }  // a user's own folders are private there
#else
/// With its last part for this user alone.
void make_private(const fs::path& folder) {
  if (folder.has_parent_path()) fs::create_directories(folder.parent_path());
  if (mkdir(folder.c_str(), S_IRWXU) != 0 && errno != EEXIST)
    throw fs::filesystem_error("", std::error_code(errno, std::generic_category()));
}
/// Whether a file or folder is this user's, and nobody else can do anything with it. A link is not looked through.
bool is_private(const fs::path& path) {
  struct stat s {};
  return lstat(path.c_str(), &s) == 0 && s.st_uid == geteuid() && (s.st_mode & (S_IRWXG | S_IRWXO)) == 0 &&
         (S_ISDIR(s.st_mode) || S_ISREG(s.st_mode));
}
#endif

void write_private(const fs::path& file, const std::string& key, const Bytes& binary) {
  const Head head = head_of(key, binary);
  std::ofstream stream(file, std::ios::binary);
  fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
  stream.write(reinterpret_cast<const char*>(&head), sizeof head);
  stream.write(key.data(), static_cast<std::streamsize>(key.size()));
  stream.write(reinterpret_cast<const char*>(binary.data()), static_cast<std::streamsize>(binary.size()));
  stream.close();
  if (!stream) throw fs::filesystem_error("", std::make_error_code(std::errc::io_error));
}

/// Removes files that haven't been used for longest, as long as all are larger than the bound.
void make_room(const fs::path& folder) {
  struct Kept {
    fs::file_time_type used;
    std::uintmax_t bytes;
    fs::path path;
  };
  std::vector<Kept> all;
  std::uintmax_t bytes = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;  // temporary ones of processes that were killed count, too
    all.push_back({entry.last_write_time(), entry.file_size(), entry.path()});
    bytes += all.back().bytes;
  }
  std::sort(all.begin(), all.end(), [](const Kept& a, const Kept& b) { return a.used < b.used; });
  for (auto oldest = all.begin(); bytes > most_bytes && oldest != all.end(); ++oldest) {
    fs::remove(oldest->path);
    bytes -= oldest->bytes;
  }
}

}  // namespace

ProgramCache::ProgramCache(fs::path folder) : folder_(std::move(folder)) {
  const auto fail = [&](const std::string& why) {
    throw Error(ErrorKind::usage, "folder for compiled programs '" + folder_.string() + "': " + why);
  };
  try {
    make_private(folder_);
    if (!fs::is_directory(folder_)) fail("it is no folder; give another");
  } catch (const fs::filesystem_error& failed) {
    fail("it can't be made (" + failed.code().message() + "); give one that can");
  }
  if (!is_private(folder_)) fail("others own it or may use it; give one of your own that has mode 0700");
}

std::optional<Bytes> ProgramCache::find(const std::string& key) const {
  if (folder_.empty()) return std::nullopt;
  const fs::path file = file_of(folder_, key);
  if (!is_private(file)) return std::nullopt;
  std::ifstream stream(file, std::ios::binary);
  Head head{};
  std::error_code failed;
  stream.read(reinterpret_cast<char*>(&head), sizeof head);
  if (!stream || head.magic != magic || head.key_bytes != key.size() ||
      fs::file_size(file, failed) != sizeof head + head.key_bytes + head.binary_bytes)
    return std::nullopt;
  std::string its_key(key.size(), '\0');
  Bytes binary(head.binary_bytes);
  stream.read(its_key.data(), static_cast<std::streamsize>(its_key.size()));
  stream.read(reinterpret_cast<char*>(binary.data()), static_cast<std::streamsize>(binary.size()));
  if (!stream || its_key != key || head_of(key, binary).checksum != head.checksum) return std::nullopt;
  fs::last_write_time(file, fs::file_time_type::clock::now(), failed);  // used
  return binary;
}

void ProgramCache::keep(const std::string& key, const Bytes& binary) const noexcept {
  if (folder_.empty()) return;
  fs::path temporary;
  try {
    temporary = folder_ / (std::to_string(std::random_device{}()) + ".new");
    write_private(temporary, key, binary);
    fs::rename(temporary, file_of(folder_, key));
    make_room(folder_);
  } catch (...) {
    std::error_code ignored;
    if (!temporary.empty()) fs::remove(temporary, ignored);
  }
}

void ProgramCache::forget(const std::string& key) const noexcept {
  try {
    if (!folder_.empty()) fs::remove(file_of(folder_, key));
  } catch (...) {  // it is overwritten or passed over next time
    return;
  }
}

}  // namespace parian
