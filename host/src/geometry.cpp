// Buffers of the mesh and what fills them.
#include "geometry.hpp"

#include <algorithm>

#include "passes.hpp"

namespace parian {
namespace {

/// What the rasteriser keeps of a view.
void allocate_records(Passes& p) {
  Geometry& g = p.geometry;
  g.n_records = g.n_triangles * p.plan.slots;
  g.records = p.compute.buffer<kernels::RasterTriangle>(std::max(
      std::size_t{g.n_records}, g.n_positions * sizeof(cl_int4) / sizeof(kernels::RasterTriangle) + 1));  // or corners
  g.large = p.compute.buffer<cl_uint>(g.n_records);
  g.n_large = p.compute.buffer<cl_uint>(1);
}

kernels::float4 to_float4(glm::dvec3 v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), 0.0F};
}

}  // namespace

void upload_geometry(Passes& p, const Mesh& mesh) {
  std::vector<kernels::float4> positions;
  positions.reserve(mesh.positions.size());
  for (const glm::dvec3& x : mesh.positions) {
    const glm::vec3 o((x - p.plan.space.centre) / p.plan.space.radius);
    positions.push_back({o.x, o.y, o.z, 1.0F});
  }
  static_assert(sizeof(glm::uvec3) == 3 * sizeof(cl_uint) && sizeof(glm::vec3) == 3 * sizeof(float));
  Geometry& g = p.geometry;
  g.positions = p.compute.upload(positions);
  g.triangles = p.compute.upload(mesh.triangles);
  g.normals = p.compute.upload(mesh.normals);
  g.n_positions = static_cast<cl_uint>(mesh.positions.size());
  g.n_triangles = static_cast<cl_uint>(mesh.triangles.size());
  allocate_records(p);
}

void allocate_geometry(Passes& p, std::size_t positions, std::size_t triangles) {
  Geometry& g = p.geometry;
  g.n_positions = static_cast<cl_uint>(positions);
  g.n_triangles = static_cast<cl_uint>(triangles);
  g.positions = p.compute.buffer<kernels::float4>(positions);
  g.triangles = p.compute.buffer<cl_uint>(3 * triangles);
  g.normals = p.compute.buffer<float>(9 * triangles);
  g.normal_sums = p.compute.buffer<cl_int>(3 * positions);
  allocate_records(p);
}

void read_geometry(Passes& p, const DeviceMesh& mesh) {
  Geometry& g = p.geometry;
  // The centre in two parts, so that a mesh far from the origin keeps the digits that its floats have.
  const kernels::float4 centre = to_float4(p.plan.space.centre);
  const kernels::float4 rest = to_float4(p.plan.space.centre - glm::dvec3(centre.x, centre.y, centre.z));
  p.compute.launch("geometry_positions", g.n_positions, Stage::light_map, g.n_positions, mesh.positions,
                   mesh.first_position, mesh.position_stride, centre, rest,
                   static_cast<float>(1.0 / p.plan.space.radius), g.positions);
  p.compute.launch("geometry_triangles", g.n_triangles, Stage::light_map, g.n_triangles, g.n_positions, mesh.indices,
                   mesh.first_index, g.positions, g.triangles);
  p.compute.fill(g.normal_sums, 0, std::size_t{3} * g.n_positions);
  p.compute.launch("geometry_normals_add", g.n_triangles, Stage::light_map, g.n_triangles, g.positions, g.triangles,
                   g.normal_sums);
  p.compute.launch("geometry_normals", g.n_triangles, Stage::light_map, g.n_triangles, g.positions, g.triangles,
                   g.normal_sums, g.normals);
  g.set_up.reset();
}

}  // namespace parian
