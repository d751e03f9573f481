// Files, variables and libraries by which OpenCL's loader finds drivers, and PoCL's needs.
#include "core/drivers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "core/ascii.hpp"

#ifdef __linux__
#include <CL/cl.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <grp.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>
#endif

namespace parian {

std::string Driver::name() const { return fmt::format("{}, which {} names,", library, place); }

#ifdef __linux__
namespace {

namespace fs = std::filesystem;

constexpr const char* usual_folder = "/etc/OpenCL/vendors";
constexpr std::uint64_t free_space = 8 << 20;  // what Parian's kernels take, several times over

/// A variable of the environment; empty where it is unset.
std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

std::string error_text(int code) { return std::generic_category().message(code); }

bool is_there(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

/// The .icd files of a folder, by name.
std::vector<fs::path> icd_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    if (entry->path().string().ends_with(".icd")) files.push_back(entry->path());
  std::sort(files.begin(), files.end());
  return files;
}

/// What a .icd file registers: its first line.
Driver driver_of(const fs::path& file) {
  Driver driver{file.string(), {}, {}};
  errno = 0;
  std::ifstream stream(file);
  if (!stream)
    driver.trouble = error_text(errno);
  else if (!std::getline(stream, driver.library) || driver.library.empty())
    driver.trouble = "it names no library";
  return driver;
}

/// Without a variable that hides the usual folder: what is there then.
std::string remedy_without(const char* name) {
  std::string there;
  for (const fs::path& file : icd_files(usual_folder)) there += (there.empty() ? "" : ", ") + file.filename().string();
  return there.empty() ? fmt::format("unset {}, and {}", name, get_a_driver)
                       : fmt::format("unset {}: {} has {}", name, usual_folder, there);
}

/// All of a folder, which `name` names, if anything does.
RegisteredDrivers drivers_in(const std::string& folder, const char* name) {
  RegisteredDrivers found;
  for (const fs::path& file : icd_files(folder)) found.drivers.push_back(driver_of(file));
  found.none = {fmt::format("no driver is registered in {}{}, which {}", folder, name ? fmt::format(" ({})", name) : "",
                            is_folder(folder) ? "has no .icd file" : "is no folder that can be read"),
                name ? remedy_without(name) : get_a_driver,
                {}};
  return found;
}

/// What OCL_ICD_VENDORS means: a folder, a .icd file, which is first looked for in `folder`, or a library.
RegisteredDrivers drivers_of(const std::string& vendors, const std::string& folder) {
  constexpr const char* name = "OCL_ICD_VENDORS";
  if (is_folder(vendors)) return drivers_in(vendors, name);
  RegisteredDrivers found;
  const bool bare = vendors.find('/') == std::string::npos;
  if (vendors.ends_with(".icd")) {
    for (const fs::path& file : {bare ? fs::path(folder) / vendors : fs::path(vendors), fs::path(vendors)})
      if (found.drivers.empty() && is_there(file)) found.drivers.push_back(driver_of(file));
    found.none = {fmt::format("{} is '{}', and there is no such file{}", name, vendors, bare ? " in " + folder : ""),
                  remedy_without(name),
                  {}};
  } else if (bare || is_there(vendors)) {
    found.drivers.push_back({name, vendors, {}});
  } else {
    found.none = {
        fmt::format("{} is '{}', and there is no such file or folder", name, vendors), remedy_without(name), {}};
  }
  return found;
}

using ExtensionFunction = void* (*)(const char*);
using PlatformIds = cl_int (*)(cl_uint, cl_platform_id*, cl_uint*);

bool lacks_memory(const std::string& text) {
  return text.find("annot allocate") != std::string::npos || text.find("failed to map segment") != std::string::npos ||
         text.find("annot create") != std::string::npos;
}

/// The nearest folder on the way to `path` that is there.
fs::path existing_part(fs::path path) {
  while (!is_there(path) && path.has_relative_path()) path = path.parent_path();
  return path.empty() ? "." : path;
}

/// Why no library can be made in a folder that is there, or loaded from it; empty if it can.
std::string folder_trouble(const fs::path& folder) {
  std::string file = (folder / ".parian-XXXXXX").string();
  const int made = mkostemp(file.data(), O_CLOEXEC);
  if (made < 0) return error_text(errno);
  close(made);
  unlink(file.c_str());
  struct statvfs system {};
  if (statvfs(folder.c_str(), &system) != 0) return {};
  if (system.f_flag & ST_NOEXEC) return "it is mounted noexec";
  if (system.f_blocks > 0 && system.f_bavail * system.f_frsize < free_space)
    return fmt::format("less than {} MB are free there", free_space >> 20);
  return {};
}

}  // namespace

RegisteredDrivers registered_drivers() {
  const std::string vendors = variable("OCL_ICD_VENDORS"), path = variable("OPENCL_VENDOR_PATH");
  const std::string folder = path.empty() ? usual_folder : path;
  RegisteredDrivers found =
      vendors.empty() ? drivers_in(folder, path.empty() ? nullptr : "OPENCL_VENDOR_PATH") : drivers_of(vendors, folder);
  const std::string files = variable("OCL_ICD_FILENAMES");
  for (std::size_t begin = 0; begin < files.size();) {
    const std::size_t end = std::min(files.find(':', begin), files.size());
    if (end > begin) found.drivers.push_back({"OCL_ICD_FILENAMES", files.substr(begin, end - begin), {}});
    begin = end + 1;
  }
  return found;
}

Trouble driver_trouble(const Driver& driver) {
  const std::string names = driver.place + ' ' + driver.library;
  if (!driver.trouble.empty())
    return {fmt::format("{} names no driver ({})", driver.place, driver.trouble), "mend or remove that file", names};
  const std::string again =
      driver.place.ends_with(".icd") ? "install that driver anew, or remove the file" : "mend or unset " + driver.place;
  // It stays open, as others do: some drivers don't bear being closed.
  void* const library = dlopen(driver.library.c_str(), RTLD_LAZY | RTLD_LOCAL);
  if (!library) {
    const char* told = dlerror();
    const std::string reason = told ? told : "no reason given";
    const bool memory = lacks_memory(reason) && memory_limit() > 0;
    return {fmt::format("{} doesn't load ({})", driver.name(), reason), memory ? memory_remedy() : again, names};
  }
  const auto function = reinterpret_cast<ExtensionFunction>(dlsym(library, "clGetExtensionFunctionAddress"));
  void* ids = function ? function("clIcdGetPlatformIDsKHR") : nullptr;
  if (!ids) ids = dlsym(library, "clIcdGetPlatformIDsKHR");
  if (!function || !ids)
    return {fmt::format("{} is no OpenCL driver (it lacks {})", driver.name(),
                        function ? "clIcdGetPlatformIDsKHR" : "clGetExtensionFunctionAddress"),
            again, names};
  cl_uint count = 0;
  const cl_int code = reinterpret_cast<PlatformIds>(ids)(0, nullptr, &count);
  if (code == CL_SUCCESS && count > 0) return {};
  return {fmt::format("{} finds no hardware of its own (code {})", driver.name(), code),
          code == CL_OUT_OF_HOST_MEMORY ? memory_remedy() : get_a_driver, names};
}

Trouble device_file_trouble() {
  std::vector<fs::path> files{"/dev/kfd", "/dev/nvidiactl", "/dev/nvidia0"};
  std::error_code error;
  for (fs::directory_iterator entry("/dev/dri", error), end; !error && entry != end; entry.increment(error))
    if (entry->path().filename().string().starts_with("renderD")) files.push_back(entry->path());
  for (const fs::path& file : files) {
    struct stat status {};
    if (stat(file.c_str(), &status) != 0 || faccessat(AT_FDCWD, file.c_str(), R_OK | W_OK, AT_EACCESS) == 0) continue;
    const int code = errno;
    const group* owners = getgrgid(status.st_gid);
    const std::string name = owners ? owners->gr_name : std::to_string(status.st_gid);
    return {fmt::format("a GPU's {} can't be opened ({})", file.string(), error_text(code)),
            fmt::format("become a member of its group, '{}'", name),
            {}};
  }
  return {};
}

std::uint64_t memory_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return 0;
  return limit.rlim_cur;
}

PoclCache pocl_cache() {
  const std::string last = variable("POCL_KERNEL_CACHE") == "0" ? "/pocl/uncached" : "/pocl/kcache";
  if (std::string set = variable("POCL_CACHE_DIR"); !set.empty()) return {std::move(set), "POCL_CACHE_DIR"};
  if (const std::string caches = variable("XDG_CACHE_HOME"); !caches.empty()) return {caches + last, "XDG_CACHE_HOME"};
  if (std::getenv("HOME")) return {variable("HOME") + "/.cache" + last, "HOME"};
  return {"/tmp" + last, {}};
}

std::string kernel_folder_trouble(const std::string& folder) {
  const fs::path nearest = existing_part(folder);
  return is_folder(nearest) ? folder_trouble(nearest) : nearest.string() + " is no folder";
}

Trouble pocl_cache_trouble() {
  const PoclCache cache = pocl_cache();
  struct stat status {};
  std::string reason;
  if (cache.source.empty() && lstat("/tmp/pocl", &status) == 0 && status.st_uid != geteuid())
    reason = "/tmp/pocl belongs to another user";
  else
    reason = kernel_folder_trouble(cache.folder);
  if (reason.empty()) return {};
  return {fmt::format("PoCL can't keep compiled kernels in {}{}: {}", cache.folder,
                      cache.source.empty() ? "" : " (" + cache.source + ")", reason),
          "set POCL_CACHE_DIR to a folder that can be written",
          {}};
}

bool hwloc_is_blind() {
  return !is_folder("/sys/devices/system/cpu") && variable("HWLOC_SYNTHETIC").empty() &&
         variable("HWLOC_XMLFILE").empty() && variable("HWLOC_FSROOT").empty();
}

Trouble pocl_would_abort() {
  const char* cache = std::getenv("POCL_CACHE_DIR");
  const bool empty = cache && !*cache;
  if ((!empty && !hwloc_is_blind()) || !has_pocl(registered_drivers())) return {};
  if (empty) return {"PoCL would abort, as POCL_CACHE_DIR is set to nothing", "unset it, or name a folder", {}};
  return {"PoCL would abort, as sysfs, which tells it of processors and memory, isn't mounted at /sys",
          "mount it (mount -t sysfs sysfs /sys), or set HWLOC_SYNTHETIC, such as to 'numa(memory=4GB) core:4 pu:1'",
          {}};
}

#else

RegisteredDrivers registered_drivers() { return {{}, {"", get_a_driver, {}}}; }
Trouble driver_trouble(const Driver&) { return {}; }
Trouble device_file_trouble() { return {}; }
std::uint64_t memory_limit() { return 0; }
PoclCache pocl_cache() { return {}; }
std::string kernel_folder_trouble(const std::string&) { return {}; }
Trouble pocl_cache_trouble() { return {}; }
bool hwloc_is_blind() { return false; }
Trouble pocl_would_abort() { return {}; }

#endif

std::string memory_remedy() {
  const std::uint64_t limit = memory_limit();
  return limit == 0 ? "give this process more memory"
                    : fmt::format("raise the limit of this process's memory, {} MB now (ulimit -v)", limit >> 20);
}

bool has_pocl(const RegisteredDrivers& registered) {
  return std::any_of(registered.drivers.begin(), registered.drivers.end(), [](const Driver& driver) {
    return ascii::lower(driver.library).find("pocl") != std::string::npos;
  });
}

}  // namespace parian
