// Reads mesh files: PLY, OBJ, OFF, STL and OM, all through OpenMesh's readers.
#pragma once
#include <filesystem>

#include "mesh.hpp"

namespace parian {

/// Reads a .ply, .obj, .off, .stl or .om file (extension in any case; ASCII or binary, either byte order, faces of
/// any valence). Points come in double precision wherever the file holds it. STL points at equal positions are
/// joined, and STL triangles with two equal corners left out. Strips of triangles become triangles, with -1 as a
/// restart. Faces of fewer than three corners, and what no picture shows, are left out with a warning each. Normals of
/// points or corners come along; those of faces, which say nothing that the points don't, stay behind.
/// Throws Error(input) with "FILE:LINE: what is wrong; what to do", before any allocation that the file's size doesn't
/// justify. Calls from several threads are served one after the other, since OpenMesh's readers are global objects.
[[nodiscard]] PolygonMesh read_mesh_file(const std::filesystem::path& path);

}  // namespace parian
