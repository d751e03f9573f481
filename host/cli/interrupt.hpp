// Ctrl-C, SIGTERM and SIGHUP as a request to finish what is under way.
#pragma once

namespace parian {

/// What the parent had this process ignore of these, as nohup does, stays ignored, whatever drivers set up later. Call
/// it before there are other threads.
void keep_ignored_signals();

/// From now on the first of them only sets what interrupted() tells; a second one of its kind ends the process at once.
void listen_for_interrupt();
/// Whether one has come since. Until then it listens anew: drivers' compilers may have set handlers of their own.
[[nodiscard]] bool interrupted();
/// The exit code for the signal that came first, as shells have it: 128 and its number.
[[nodiscard]] int exit_interrupted();

}  // namespace parian
