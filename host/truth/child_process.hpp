// Work whose end can't be trusted, such as a driver's first steps, in a process of its own.
#pragma once
#include <functional>
#include <string>

namespace parian {

/// What came of work in another process.
struct ChildOutcome {
  std::string told;     ///< all that it told until it ended
  std::string trouble;  ///< why it didn't end by itself, such as "crashed (signal 11)"; empty when it did
};

/// Runs `work` in a copy of this process, which has this one's memory but none of its threads, and hands it a function
/// that tells text to this process. What it prints goes to standard error. After `seconds`, and when this process ends,
/// it is killed.
[[nodiscard]] ChildOutcome in_child_process(
    double seconds, const std::function<void(const std::function<void(const std::string&)>& tell)>& work);

}  // namespace parian
