// The tool on a terminal: standard error on one of its own, whose width is known, and signals while it runs.
#pragma once
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <filesystem>
#include <string>

namespace parian::test {

class OnTerminal {
 public:
  /// Starts a line of the shell in `folder`, whose standard output goes to out.txt there.
  OnTerminal(const std::filesystem::path& folder, const std::string& line, unsigned short columns = 80) {
    winsize window{24, columns, 0, 0};
    int terminal = -1;
    if (openpty(&master_, &terminal, nullptr, nullptr, &window) != 0) return;
    const std::string command = "cd '" + folder.string() + "' && " + line + " >out.txt </dev/null";
    child_ = fork();
    if (child_ == 0) {
      for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_DFL);  // whatever this process ignores
      close(master_);
      dup2(terminal, STDERR_FILENO);
      close(terminal);
      execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
      _exit(127);
    }
    close(terminal);
  }
  ~OnTerminal() {
    if (child_ > 0) {
      kill(child_, SIGKILL);
      finish();
    }
    if (master_ >= 0) close(master_);
  }
  OnTerminal(const OnTerminal&) = delete;
  OnTerminal& operator=(const OnTerminal&) = delete;

  /// Reads until the terminal has shown `text` once more; false if the tool ended before.
  bool wait_for(const std::string& text) {
    while (shown_.find(text, seen_) == std::string::npos)
      if (!read_some()) return false;
    seen_ = shown_.size();
    return true;
  }
  void send(int signal) const { kill(child_, signal); }
  /// Waits for the end; the exit code as shells have it.
  int finish() {
    while (read_some()) {
    }
    int status = 0;
    waitpid(child_, &status, 0);
    child_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  [[nodiscard]] const std::string& shown() const { return shown_; }

 private:
  bool read_some() {
    std::array<char, 4096> buffer{};
    const ssize_t n = read(master_, buffer.data(), buffer.size());
    if (n > 0) shown_.append(buffer.data(), static_cast<std::size_t>(n));
    return n > 0;
  }

  int master_ = -1;
  pid_t child_ = -1;
  std::string shown_;
  std::size_t seen_ = 0;
};

}  // namespace parian::test
