// Before OpenCL's first call: an environment in which drivers work, and a last word for when one ends this process.
#pragma once
#include <string>

namespace parian {

/// Gives PoCL a private folder for compiled kernels where its usual one is of no use, and the processors and memory
/// that it can't see without sysfs; variables that the user has set stay. From now on, where a driver crashes or exits,
/// a line says so and what to do, and the exit code is 4. Call it before OpenCL's first call. Returns what there is to
/// say of the folder; empty if nothing.
std::string guard_drivers();

/// From now on the process may end as it likes: at the command's own end, and in a child whose end is awaited.
void unguard_drivers() noexcept;

/// What to do about a driver that ended a process: PoCL, another, or one of those that are registered.
enum class Culprit { pocl, other, unknown };
[[nodiscard]] std::string crash_remedy(Culprit culprit);

}  // namespace parian
