// Ctrl-C as a request to finish what is under way.
#pragma once

namespace parian {

inline constexpr int exit_interrupted = 130;

/// From now on the first Ctrl-C only sets what interrupted() tells; a second one ends the process at once.
void listen_for_interrupt();
[[nodiscard]] bool interrupted();

}  // namespace parian
