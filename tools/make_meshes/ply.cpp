// Binary little-endian PLY with float positions and triangles; written in one order, so equal meshes are equal bytes.
#include <bit>
#include <cstdint>
#include <fstream>
#include <stdexcept>

#include "surface.h"

namespace make_meshes {

static_assert(std::endian::native == std::endian::little, "write_ply() copies words as they are in memory");

void write_ply(const std::string& path, const Mesh& mesh) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(mesh.points.size()) +
                      "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                      std::to_string(mesh.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
  const auto put = [&](auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  for (const glm::dvec3 p : mesh.points) {
    for (int i = 0; i < 3; ++i) put(static_cast<float>(p[i]) + 0.0f);  // + 0 turns -0 into 0
  }
  for (const auto& t : mesh.triangles) {
    put(std::uint8_t{3});
    for (const unsigned v : t) put(static_cast<std::int32_t>(v));
  }
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) throw std::runtime_error("cannot write " + path);
}

}  // namespace make_meshes
