// The handler, and the flag that it sets.
#include "interrupt.hpp"

#include <csignal>

namespace parian {
namespace {

volatile std::sig_atomic_t raised = 0;

}  // namespace

void listen_for_interrupt() {
  struct sigaction action {};
  action.sa_handler = [](int) { raised = 1; };
  action.sa_flags = SA_RESETHAND | SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
}

bool interrupted() { return raised != 0; }

}  // namespace parian
