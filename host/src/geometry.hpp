// The mesh on the device: copied from host memory once, or read from its owner's buffers whenever it has moved.
#pragma once
#include <CL/opencl.hpp>

#include "mesh.hpp"

namespace parian {

struct Passes;

/// A mesh in somebody's buffers, positions as float x, y, z and triangles as three uint each; everything in words of
/// four bytes.
struct DeviceMesh {
  cl::Buffer positions, indices;
  cl_uint first_position = 0, position_stride = 3, first_index = 0;
};

/// Fills the passes' geometry from host memory. Waits.
void upload_geometry(Passes& p, const Mesh& mesh);
/// Makes room for a mesh that lies on the device.
void allocate_geometry(Passes& p, std::size_t positions, std::size_t triangles);
/// Fills the passes' geometry from it: positions in object units, safe triangles, normals of corners.
void read_geometry(Passes& p, const DeviceMesh& mesh);

}  // namespace parian
