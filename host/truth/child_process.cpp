// A child process, a pipe from it, and a deadline.
#include "truth/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>

#include "core/error.hpp"

#ifdef __linux__
#include <sys/prctl.h>
#endif

namespace parian {
namespace {

void write_whole(int file, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t n = write(file, text.data() + done, text.size() - done);
    if (n > 0)
      done += static_cast<std::size_t>(n);
    else if (errno != EINTR)
      return;
  }
}

/// Reads to the end; false when `seconds` are over before that.
bool read_whole(int file, double seconds, std::string& text) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  std::array<char, 4096> buffer{};
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    if (left <= 0) return false;
    pollfd waited{file, POLLIN, 0};
    if (poll(&waited, 1, static_cast<int>(std::min<long long>(left, 60'000))) <= 0) continue;
    const ssize_t n = read(file, buffer.data(), buffer.size());
    if (n == 0 || (n < 0 && errno != EINTR)) return true;
    if (n > 0) text.append(buffer.data(), static_cast<std::size_t>(n));
  }
}

/// Has this process killed when its parent ends, where the system can do that.
void end_with([[maybe_unused]] pid_t parent) {
#ifdef __linux__
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);  // it has ended already
#endif
}

}  // namespace

ChildOutcome in_child_process(double seconds,
                              const std::function<void(const std::function<void(const std::string&)>& tell)>& work) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw Error(ErrorKind::device, std::string("no pipe: ") + std::strerror(errno));
  for (const int end : ends) fcntl(end, F_SETFD, FD_CLOEXEC);
  const pid_t parent = getpid(), child = fork();
  if (child < 0) throw Error(ErrorKind::device, std::string("no process: ") + std::strerror(errno));
  if (child == 0) {
    end_with(parent);
    dup2(STDERR_FILENO, STDOUT_FILENO);
    int code = 0;
    try {
      work([&](const std::string& text) { write_whole(ends[1], text); });
    } catch (...) {
      code = 1;
    }
    _exit(code);
  }
  close(ends[1]);
  ChildOutcome outcome;
  const bool ended = read_whole(ends[0], seconds, outcome.told);
  close(ends[0]);
  if (!ended) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!ended)
    outcome.trouble = fmt::format("no answer within {} s", seconds);
  else if (WIFSIGNALED(status))
    outcome.trouble = fmt::format("crashed (signal {})", WTERMSIG(status));
  else if (WEXITSTATUS(status) != 0)
    outcome.trouble = fmt::format("ended by itself (exit code {})", WEXITSTATUS(status));
  return outcome;
}

}  // namespace parian
