// Writing beside, then renaming.
#include "io/whole_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "core/error.hpp"

namespace parian {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::string& what) {
  throw Error(ErrorKind::output, fmt::format("{}: {}", path.string(), what));
}

/// Waits until the file's bytes are on the disk, where a full one shows at last.
bool flush_to_disk(const fs::path& file) {
  const int handle = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (handle < 0) return false;
  const bool done = ::fsync(handle) == 0 || errno == EINVAL || errno == EROFS;
  return ::close(handle) == 0 && done;
}

/// A name beside `place`, for this process's file number `count`. It keeps the extension of the name that was given, by
/// which writers of pictures go.
fs::path temporary_name(const fs::path& place, const fs::path& given, unsigned count) {
  constexpr std::size_t longest_extension = 16;
  std::string extension = given.extension().string();
  if (extension.size() > longest_extension) extension.clear();
  return place.parent_path() / fmt::format(".parian-{}-{:04}{}", ::getpid(), count, extension);
}

/// Whether the file system can't have a file of that name.
bool is_too_long(const fs::path& path) {
  std::error_code problem;
  (void)fs::symlink_status(path, problem);
  return problem == std::errc::filename_too_long;
}

}  // namespace

fs::path final_place(const fs::path& path) {
  constexpr int most_links = 40;  // as the system's own
  fs::path place = path;
  std::error_code failed;
  for (int links = 0; fs::is_symlink(place, failed); ++links) {
    if (links == most_links) fail(path, "is a link that leads in circles; remove it or give another name");
    const fs::path target = fs::read_symlink(place, failed);
    if (failed) break;
    place = place.parent_path() / target;  // which is the target alone if that is absolute
  }
  return place;
}

void check_place(const fs::path& path) {
  std::error_code ignored;
  if (!path.has_filename()) fail(path, "names no file; give a file's name");
  const fs::path place = final_place(path);
  const fs::path folder = place.has_parent_path() ? place.parent_path() : fs::path(".");
  const fs::file_status there = fs::status(folder, ignored);
  if (!fs::exists(there)) fail(path, fmt::format("there is no folder '{}'; create it first", folder.string()));
  if (!fs::is_directory(there)) fail(path, fmt::format("'{}' is not a folder; choose another", folder.string()));
  if (is_too_long(place) || is_too_long(temporary_name(place, path, 0)))
    fail(path, "the name is too long for the file system; give a shorter one");
  const fs::file_status status = fs::status(path, ignored);
  if (fs::is_directory(status)) fail(path, "is a folder; give a file's name");
  if (fs::exists(status) && !fs::is_regular_file(status)) fail(path, "is not a regular file; give another name");
  if (::access(folder.c_str(), W_OK | X_OK) != 0) {
    fail(path,
         fmt::format("the folder '{}' can't be written ({}); choose another", folder.string(), std::strerror(errno)));
  }
}

WholeFile::WholeFile(const fs::path& path) : path_(path) {
  static std::atomic<unsigned> count{0};
  check_place(path);
  target_ = final_place(path);  // a link stays a link
  temporary_ = temporary_name(target_, path, count++);
}

WholeFile::~WholeFile() {
  std::error_code ignored;
  if (!committed_) fs::remove(temporary_, ignored);
}

void WholeFile::commit() {
  if (!flush_to_disk(temporary_)) {
    fail(path_,
         fmt::format("could not be written ({}); free some space or choose another folder", std::strerror(errno)));
  }
  std::error_code failed;
  fs::rename(temporary_, target_, failed);
  if (failed) fail(path_, fmt::format("could not be put in place ({}); choose another name", failed.message()));
  committed_ = true;
}

void write_text(const fs::path& path, std::string_view text) {
  WholeFile file(path);
  std::ofstream stream(file.temporary(), std::ios::binary);
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.close();
  if (!stream) fail(path, "could not be written; free some space or choose another folder");
  file.commit();
}

}  // namespace parian
