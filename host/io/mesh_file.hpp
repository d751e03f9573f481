// Reads mesh files: PLY, OBJ, OFF and STL, and OM through OpenMesh's reader. OpenMesh's readers of the others take
// truncated files for whole ones, believe any count, read coordinates as floats, skip bad vertices (which shifts every
// index), read PLY lists of most types wrongly, know no comments in OFF, and join NaNs in STL with any point.
#pragma once
#include <filesystem>

#include "scene/mesh.hpp"

namespace parian {

/// Reads a .ply, .obj, .off, .stl or .om file (extension in any case; ASCII or binary, either byte order, faces of
/// any valence). Points come in double precision wherever the file holds it. STL points at equal positions are
/// joined, and STL triangles with two equal corners left out. Strips of triangles become triangles, with -1 as a
/// restart. Faces of fewer than three corners, and what no picture shows, are left out with a warning each. Normals of
/// points or corners come along; those of faces, which say nothing that the points don't, stay behind.
/// Throws Error(input) with "FILE:LINE: what is wrong; what to do", before any allocation that the file's size doesn't
/// justify. Calls from several threads for OM files are served one after the other, since OpenMesh's reader is a global
/// object.
[[nodiscard]] PolygonMesh read_mesh_file(const std::filesystem::path& path);

}  // namespace parian
