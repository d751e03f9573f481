// Named cases at the limits of what can be rendered, each with its documented outcome: a right value, or a refusal.
#pragma once
#include <functional>
#include <vector>

#include "truth/trial.hpp"

namespace parian {

struct ExtremeCase {
  const char* kind;     ///< optical, geometric, lighting, camera or resource
  const char* name;     ///< what is extreme
  const char* outcome;  ///< what is documented to happen
  std::function<Finding(Trial&)> run;
};

/// All of them, by kind.
[[nodiscard]] const std::vector<ExtremeCase>& extreme_cases();

/// Adds those of media.
void add_extreme_media(std::vector<ExtremeCase>& list);

}  // namespace parian
