// The handler, and the signal that it keeps.
#include "interrupt.hpp"

#include <array>
#include <csignal>

namespace parian {
namespace {

constexpr std::array signals = {SIGINT, SIGTERM, SIGHUP};

volatile std::sig_atomic_t first_signal = 0;

void keep_first(int signal) {
  if (first_signal == 0) first_signal = signal;
}

}  // namespace

void keep_ignored_signals() {
  sigset_t ignored;
  sigemptyset(&ignored);
  for (const int signal : signals) {
    struct sigaction before {};
    if (sigaction(signal, nullptr, &before) == 0 && before.sa_handler == SIG_IGN) sigaddset(&ignored, signal);
  }
  sigprocmask(SIG_BLOCK, &ignored, nullptr);  // no handler gets what is blocked
}

void listen_for_interrupt() {
  struct sigaction action {};
  action.sa_handler = keep_first;
  action.sa_flags = SA_RESETHAND | SA_RESTART;
  sigemptyset(&action.sa_mask);
  for (const int signal : signals) sigaction(signal, &action, nullptr);
}

bool interrupted() {
  if (first_signal == 0) listen_for_interrupt();
  return first_signal != 0;
}

int exit_interrupted() { return 128 + first_signal; }

}  // namespace parian
