// Parts of Parian that are loaded when they are needed first, for what they bring along.
#pragma once
#include "core/error.hpp"

namespace parian {

/// The symbol of a module, a file beside the program or where it is installed; the module stays loaded. Throws
/// Error(kind) that begins with `fault` and has the loader's reason.
[[nodiscard]] const void* module_symbol(const char* module, const char* symbol, ErrorKind kind, const char* fault);

}  // namespace parian
