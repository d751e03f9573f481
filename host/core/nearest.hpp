// Suggestions for misspelt words, and names compared as Parian compares them.
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace parian {

/// The candidate nearest to `word` by edit distance (case ignored), or "" when none is near enough to be meant.
[[nodiscard]] std::string nearest(std::string_view word, const std::vector<std::string>& candidates);

/// All of `names`, nearest to `word` by edit distance first, as plain_name has both; equally near ones by alphabet.
[[nodiscard]] std::vector<std::string> nearest_first(std::string_view word, const std::vector<std::string>& names);

/// "did you mean 'X'?" when a candidate is near, else "use one of: A, B, C".
[[nodiscard]] std::string suggestion(std::string_view word, const std::vector<std::string>& candidates);

/// `name` in lower case without spaces, '-' and '_': two names are the same material if these are equal.
[[nodiscard]] std::string plain_name(std::string_view name);

}  // namespace parian
