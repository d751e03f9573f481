// What the C API says, before it is put in the API's words: for fronts that are built on it here and have their own.
#pragma once
#include <parian/parian.h>

#include <string>
#include <vector>

namespace parian {

/// parian_message of this thread, with marks (words.hpp).
[[nodiscard]] const std::string& marked_message();
/// The warnings that the last parian_get_statistics listed, with marks.
[[nodiscard]] const std::vector<std::string>& marked_warnings(const parian_renderer* renderer);

}  // namespace parian
