// Opens a mesh file and hands it to its format's reader.
#include "io/mesh_file.hpp"

#include <fmt/format.h>

#include <fstream>

#include "core/ascii.hpp"
#include "io/foreign_file.hpp"
#include "io/mesh_reading.hpp"

namespace parian {
namespace {

/// Refuses what is no file, or one of a kind that isn't read.
void check_file(const std::filesystem::path& path, const std::string& file) {
  std::error_code fault;
  const std::filesystem::file_status status = std::filesystem::status(path, fault);
  if (!std::filesystem::exists(status)) refuse(file, "no such file; check the path");
  if (std::filesystem::is_directory(status)) refuse(file, "this is a directory; name a mesh file in it");
  if (!std::filesystem::is_regular_file(status)) refuse(file, "this isn't a regular file; copy the mesh to one");
  if (const std::string kind = foreign_file(path); !kind.empty()) refuse(file, kind);
}

std::string read_bytes(const std::filesystem::path& path, const std::string& file) {
  std::error_code fault;
  const std::uintmax_t size = std::filesystem::file_size(path, fault);
  std::ifstream stream(path, std::ios::binary);
  if (fault || !stream) refuse(file, "the file can't be opened; check its permissions");
  if (size == 0) refuse(file, "the file is empty; choose a mesh");
  std::string bytes(size, '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(size));
  if (!stream) refuse(file, "the file can't be read to its end; check the disk and its permissions");
  return bytes;
}

}  // namespace

PolygonMesh read_mesh_file(const std::filesystem::path& path) {
  const std::string file = path.string();
  std::string extension = ascii::lower(path.extension().string());
  if (!extension.empty()) extension.erase(0, 1);
  MeshReading (*read)(std::string_view, const std::string&) = extension == "ply"   ? read_ply
                                                              : extension == "obj" ? read_obj
                                                              : extension == "off" ? read_off
                                                              : extension == "stl" ? read_stl
                                                              : extension == "om"  ? read_om
                                                                                   : nullptr;
  check_file(path, file);
  if (read == nullptr)
    refuse(file, fmt::format("unknown mesh format '.{}'; use .ply, .obj, .off, .stl or .om", extension));
  MeshReading reading = read(read_bytes(path, file), file);
  if (reading.mesh.face_sizes.empty()) refuse(file, "none of the faces has three corners; choose another mesh");
  reading.mesh.warnings = reading.warnings();
  return std::move(reading.mesh);
}

}  // namespace parian
