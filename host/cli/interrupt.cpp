// The handler, and the signal that it keeps.
#include "interrupt.hpp"

#include <csignal>
#include <initializer_list>

namespace parian {
namespace {

volatile std::sig_atomic_t first_signal = 0;

void keep_first(int signal) {
  if (first_signal == 0) first_signal = signal;
}

}  // namespace

void listen_for_interrupt() {
  struct sigaction action {};
  action.sa_handler = keep_first;
  action.sa_flags = SA_RESETHAND | SA_RESTART;
  sigemptyset(&action.sa_mask);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before {};
    if (sigaction(signal, nullptr, &before) == 0 && before.sa_handler == SIG_IGN) continue;
    sigaction(signal, &action, nullptr);
  }
}

bool interrupted() { return first_signal != 0; }

int exit_interrupted() { return 128 + first_signal; }

}  // namespace parian
