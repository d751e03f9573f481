// The mesh on the device: copied from host memory once, or read from its owner's buffers whenever it has moved.
#pragma once
#include <CL/opencl.hpp>

#include <optional>

#include "plan/views.hpp"
#include "scene/mesh.hpp"

namespace parian {

class Compute;
struct Passes;

/// The mesh on the device, and the rasteriser's buffers that every view uses in turn.
struct Geometry {
  cl::Buffer positions;    ///< float4 per vertex, object units
  cl::Buffer triangles;    ///< 3 uint per triangle
  cl::Buffer normals;      ///< 9 float per triangle: shading normals of its corners
  cl::Buffer normal_sums;  ///< of a mesh that lies on the device: 3 int per vertex
  cl::Buffer outside;      ///< of such a mesh: triangles that left the sphere, and the bits of how far, squared
  cl::Buffer records, large, n_large;
  std::optional<kernels::View> set_up;  ///< of which the records are
  cl_uint n_positions = 0, n_triangles = 0, n_records = 0;
};

/// A mesh in somebody's buffers, positions as float x, y, z and triangles as three uint each; everything in words of
/// four bytes.
struct DeviceMesh {
  cl::Buffer positions, indices;
  cl_uint first_position = 0, position_stride = 3, first_index = 0;
};

/// The sphere that a plan goes by: the one given if it holds a mesh in buffers, the one measured if none is given
/// (radius 0), or the smallest that holds both. Triangles that lie alone, farther off than the others reach twice, are
/// not measured.
struct MeshSphere {
  ObjectSpace space;
  double measured = 0.0;  ///< radius of the mesh's own, around its box's centre; 0: there is nothing to draw
};
/// Measures it with the kernels that `c` has built. Waits. Throws Error(input) without a sphere of either kind.
[[nodiscard]] MeshSphere measure_sphere(Compute& c, const DeviceMesh& mesh, const MeshBounds& given);
/// What to say of a sphere that doesn't fit; empty if it does.
[[nodiscard]] std::string doubt_of(const MeshSphere& sphere, const MeshBounds& given);

/// How far a mesh in buffers has left the sphere since it was last asked: triangles, and the largest distance from the
/// centre in object units. Waits.
struct Outside {
  std::uint64_t triangles = 0;
  double reach = 0.0;
};
[[nodiscard]] Outside read_outside(Passes& p);

/// Fills the passes' geometry from host memory. Waits.
void upload_geometry(Passes& p, const Mesh& mesh);
/// Makes room for a mesh that lies on the device.
void allocate_geometry(Passes& p, std::size_t positions, std::size_t triangles);
/// Fills the passes' geometry from it: positions in object units, safe triangles, normals of corners.
void read_geometry(Passes& p, const DeviceMesh& mesh);

}  // namespace parian
