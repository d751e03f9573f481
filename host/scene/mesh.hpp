// Triangle meshes: what a file gives (polygons), and what the passes need (clean triangles, corner normals).
#pragma once
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace parian {

/// Stands for a corner that no normal was given for.
inline constexpr std::uint32_t no_normal = 0xffffffffU;

/// A mesh as a file holds it: points in mesh units and faces of any valence.
struct PolygonMesh {
  std::vector<glm::dvec3> points;
  std::vector<std::uint32_t> face_sizes;        ///< corners of each face, >= 3
  std::vector<std::uint32_t> corners;           ///< point index of each corner, face after face
  std::vector<glm::vec3> normals{};             ///< given ones, of any length; empty: there are none
  std::vector<std::uint32_t> corner_normals{};  ///< each corner's among `normals`, or no_normal; empty: those of points
  std::vector<std::string> warnings{};          ///< of reading it; they go on to the mesh's
};

/// What clean_mesh met and dealt with.
struct MeshCounts {
  std::size_t faces_read = 0;  ///< polygons in the input
  std::size_t points_read = 0;
  std::size_t unreferenced_points = 0;  ///< dropped
  std::size_t duplicate_points = 0;     ///< joined: points at the same position
  std::size_t zero_area_faces = 0;      ///< dropped triangles
  std::size_t boundary_edges = 0;       ///< edges with one triangle
  std::size_t non_manifold_edges = 0;   ///< edges with more than two triangles, or two that disagree
  std::size_t parts = 0;                ///< connected components
  std::size_t parts_turned = 0;         ///< closed components that faced inward
  std::size_t triangles = 0;            ///< left
};

/// Clean triangles in double precision, with one unit normal per corner.
struct Mesh {
  std::vector<glm::dvec3> positions;
  std::vector<glm::uvec3> triangles;
  std::vector<glm::vec3> normals;  ///< 3 per triangle, unit length; shading normal of each corner
  bool closed = false;             ///< every edge has exactly two triangles of opposite direction
  MeshCounts counts;
  std::vector<std::string> warnings;  ///< one line each, without the file's name
};

/// Joins duplicate points, drops unreferenced points and zero-area triangles, triangulates polygons, turns closed
/// parts that face inward, and takes the given corner normals; where there is none, or one that isn't finite or faces
/// away, it computes one: angle-weighted, split at edges sharper than `crease_degrees`. Moving a large mesh in saves
/// its copy. Throws Error(input) on NaN or infinite coordinates, indices out of range, or when no triangle with area is
/// left.
[[nodiscard]] Mesh clean_mesh(PolygonMesh polygons, double crease_degrees = 40.0);

/// For each point the lowest point at the same position. All must be finite, and fewer than 2^32.
[[nodiscard]] std::vector<std::uint32_t> join_points(const std::vector<glm::dvec3>& points);

}  // namespace parian
