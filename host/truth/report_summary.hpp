// What a report comes to, in sentences.
#pragma once
#include <string>
#include <vector>

#include "truth/report.hpp"

namespace parian {

/// The main results: time to 1 % for Parian and the poster's method, Parian's bias, and what that leaves to reach.
[[nodiscard]] std::vector<std::string> summary(const Report& report);

}  // namespace parian
