// Variables of the environment, and handlers of signals and of exits that aren't the command's own.
#include "cli/driver_guard.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstdlib>

#include "cli/terminal.hpp"
#include "core/drivers.hpp"
#include "core/error.hpp"

namespace parian {
namespace {

constexpr std::array crashes = {SIGABRT, SIGSEGV, SIGBUS, SIGILL};  // SIGFPE is PoCL's own
constexpr int exit_code = static_cast<int>(ErrorKind::device);

// What the handlers print, made before.
std::string before_signal, after_signal, at_exit;
std::atomic<bool> guarding{false}, speaking{false};

void print(const char* text, std::size_t size) {
  if (write(STDERR_FILENO, text, size) < 0) return;  // there is nowhere left to say so
}

/// Damaged compiled kernels may crash several threads at once: one speaks.
void on_crash(int signal) {
  if (speaking.exchange(true))
    for (;;) pause();
  const std::array digits{static_cast<char>('0' + signal / 10), static_cast<char>('0' + signal % 10)};
  const std::size_t first = signal < 10 ? 1 : 0;
  print(before_signal.data(), before_signal.size());
  print(digits.data() + first, digits.size() - first);
  print(after_signal.data(), after_signal.size());
  _exit(exit_code);
}

/// Compilers inside drivers exit where they can't write.
void on_exit_of_others() {
  if (!guarding) return;
  print(at_exit.data(), at_exit.size());
  _exit(exit_code);
}

/// A folder of this user's own, which nobody else can write or read; empty if there is none.
std::string private_folder() {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);
    return std::string(value ? value : "");
  };
  const std::string temporary = variable("TMPDIR").empty() ? "/tmp" : variable("TMPDIR");
  for (const std::string& base : {variable("XDG_RUNTIME_DIR"), temporary}) {
    if (!base.starts_with('/') || !kernel_folder_trouble(base).empty()) continue;
    std::string folder = fmt::format("{}/parian-{}", base, geteuid());
    (void)mkdir(folder.c_str(), S_IRWXU);  // it may be there
    struct stat status {};
    if (lstat(folder.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && status.st_uid == geteuid() &&
        (status.st_mode & (S_IRWXG | S_IRWXO)) == 0 && kernel_folder_trouble(folder).empty())
      return folder;
  }
  return {};
}

std::string give_cache() {
  if (const char* set = std::getenv("POCL_CACHE_DIR"); set && !*set) unsetenv("POCL_CACHE_DIR");  // PoCL would abort
  if (pocl_cache().source == "POCL_CACHE_DIR") return {};
  const Trouble trouble = pocl_cache_trouble();
  if (trouble.what.empty()) return {};
  const std::string folder = private_folder();
  if (folder.empty()) return {};
  const std::string cache = folder + "/pocl";
  setenv("POCL_CACHE_DIR", cache.c_str(), 1);
  return fmt::format("{}; they are kept in {}, unless POCL_CACHE_DIR names another folder", trouble.what, cache);
}

void give_topology() {
  if (!hwloc_is_blind()) return;
  const long long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE), cores = sysconf(_SC_NPROCESSORS_ONLN);
  setenv("HWLOC_SYNTHETIC", fmt::format("pack:1 [numa(memory={})] core:{} pu:1", pages * page, cores).c_str(), 1);
}

}  // namespace

std::string guard_drivers() {
  std::string told;
  const bool pocl = has_pocl(registered_drivers());
  if (pocl) told = give_cache();
  if (pocl) give_topology();
  const std::string remedy = printable(crash_remedy(pocl ? Culprit::unknown : Culprit::other));
  const std::string begin = isatty(STDERR_FILENO) == 1 ? "\r\033[Kparian: " : "parian: ";  // over a bar of progress
  before_signal = begin + "this process crashed (signal ";
  after_signal = ") while OpenCL was in use; " + remedy + "\n";
  at_exit = begin + "an OpenCL driver ended this process; " + remedy + "\n";
  if (guarding) return told;
  for (const int signal : crashes) {
    struct sigaction action {};
    if (sigaction(signal, nullptr, &action) != 0 || action.sa_handler != SIG_DFL) continue;  // a sanitizer's
    action.sa_handler = on_crash;
    sigaction(signal, &action, nullptr);
  }
  (void)std::atexit(on_exit_of_others);
  guarding = true;
  return told;
}

void unguard_drivers() noexcept {
  if (!guarding.exchange(false)) return;
  for (const int signal : crashes) {
    struct sigaction action {};
    if (sigaction(signal, nullptr, &action) == 0 && action.sa_handler == on_crash) std::signal(signal, SIG_DFL);
  }
}

std::string crash_remedy(Culprit culprit) {
  const std::string memory = memory_limit() > 0 ? memory_remedy() + ", or " : "";
  const std::string kernels = fmt::format("delete its compiled kernels, {}, which may be damaged", pocl_cache().folder);
  const std::string other = "update the driver, or choose another device with --device";
  switch (culprit) {
    case Culprit::pocl:
      return memory + kernels + ", or choose another device with --device";
    case Culprit::other:
      return memory + other;
    case Culprit::unknown:
      break;
  }
  return fmt::format("{}if the device is PoCL's, {}; else {}", memory, kernels, other);
}

}  // namespace parian

#if defined(__has_feature)
#define PARIAN_HAS_FEATURE(x) __has_feature(x)
#else
#define PARIAN_HAS_FEATURE(x) 0
#endif
#if !defined(__SANITIZE_ADDRESS__) && !PARIAN_HAS_FEATURE(address_sanitizer) && !PARIAN_HAS_FEATURE(thread_sanitizer)
/// In place of the C library's, for this process's libraries too: the compiler inside PoCL puts a handler of its own in
/// front of on_crash, which returns, and then abort() asks no other.
extern "C" __attribute__((visibility("default"))) int sigaction(int signal, const struct sigaction* action,
                                                                struct sigaction* before) noexcept {
  using Function = int (*)(int, const struct sigaction*, struct sigaction*);
  static const auto real = reinterpret_cast<Function>(dlsym(RTLD_NEXT, "sigaction"));
  return real(signal, signal == SIGABRT && parian::guarding ? nullptr : action, before);
}
#endif
