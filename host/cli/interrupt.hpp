// Ctrl-C, SIGTERM and SIGHUP as a request to finish what is under way.
#pragma once
#include "session/session.hpp"

namespace parian {

/// What the parent had this process ignore of these, as nohup does, stays ignored, whatever drivers set up later. Call
/// it before there are other threads.
void keep_ignored_signals();

/// From now on the first of them only cancels this token; a second one of its kind ends the process at once.
const CancelToken& listen_for_interrupt();
/// Listens anew until one has come: drivers' compilers may have set handlers of their own.
void keep_listening();
/// Whether one has come since. Keeps listening.
[[nodiscard]] bool interrupted();
/// The exit code for the signal that came first, as shells have it: 128 and its number.
[[nodiscard]] int exit_interrupted();

}  // namespace parian
