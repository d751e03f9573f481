// Files of other kinds, told by what they hold: what each is, and how to get from it to something that is read.
#pragma once
#include <filesystem>
#include <string>

namespace parian {

/// What a file is that Parian doesn't read, and what to do: "glTF isn't read; export ...". By its first bytes, and
/// where these say nothing, by its name. Empty where neither is known.
[[nodiscard]] std::string foreign_file(const std::filesystem::path& path);

}  // namespace parian
