// The handler, the signal that it keeps, and the token that it cancels.
#include "cli/interrupt.hpp"

#include <array>
#include <csignal>

namespace parian {
namespace {

constexpr std::array signals = {SIGINT, SIGTERM, SIGHUP};

volatile std::sig_atomic_t first_signal = 0;
CancelToken token;

void keep_first(int signal) {
  if (first_signal == 0) first_signal = signal;
  token.cancel();
}

void listen() {
  struct sigaction action {};
  action.sa_handler = keep_first;
  action.sa_flags = SA_RESETHAND | SA_RESTART;
  sigemptyset(&action.sa_mask);
  for (const int signal : signals) sigaction(signal, &action, nullptr);
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

const CancelToken& listen_for_interrupt() {
  listen();
  return token;
}

void keep_listening() {
  if (!token.cancelled()) listen();
}

bool interrupted() {
  keep_listening();
  return token.cancelled();
}

int exit_interrupted() { return 128 + first_signal; }

}  // namespace parian
