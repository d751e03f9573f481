// Where tests find what the source tree holds for them.
#pragma once
#include <cstdlib>
#include <string>

namespace parian::test {

/// A file of the source tree: of the one compiled, or of a copy elsewhere, which PARIAN_SOURCE names.
inline std::string source_file(const std::string& name) {
  const char* copy = std::getenv("PARIAN_SOURCE");
  return std::string(copy ? copy : PARIAN_SOURCE) + "/" + name;
}

}  // namespace parian::test
