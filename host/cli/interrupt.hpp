// Ctrl-C, SIGTERM and SIGHUP as a request to finish what is under way.
#pragma once

namespace parian {

/// From now on the first of SIGINT, SIGTERM and SIGHUP only sets what interrupted() tells; a second one of its kind
/// ends the process at once. What the parent had this process ignore, as nohup does, stays ignored.
void listen_for_interrupt();
[[nodiscard]] bool interrupted();
/// The exit code for the signal that came first, as shells have it: 128 and its number.
[[nodiscard]] int exit_interrupted();

}  // namespace parian
