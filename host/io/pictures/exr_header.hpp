// The header of an EXR file, looked over before OpenEXR allocates what it promises.
#pragma once
#include <filesystem>
#include <string>

namespace parian::pictures {

/// What is wrong with the sizes that an EXR's header states, or "": each attribute must end within the file. Files of
/// other kinds pass.
[[nodiscard]] std::string exr_header_fault(const std::filesystem::path& path);

}  // namespace parian::pictures
