// What callers of the C API give: host memory, buffers and settings.
#include "api/api_given.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include "passes/geometry.hpp"
#include "plan/plan.hpp"
#include "scene/box.hpp"
#include "scene/limits.hpp"
#include "scene/rounding.hpp"

namespace parian {
namespace {

/// `bytes` in words of four.
cl_uint words(std::size_t bytes, const char* what) {
  if (bytes % 4 != 0) refuse(fmt::format("{}: {} bytes; give a multiple of 4", what, bytes));
  if (bytes / 4 > 0xffffffffU) refuse(fmt::format("{}: {} bytes; give less than 16 GiB", what, bytes));
  return static_cast<cl_uint>(bytes / 4);
}

/// Positions of a mesh in host memory.
std::vector<glm::dvec3> host_positions(const parian_mesh& m) {
  if ((m.positions != nullptr) == (m.positions_double != nullptr))
    refuse("mesh: give positions either as float or as double");
  const std::size_t size = m.positions ? sizeof(float) : sizeof(double);
  const std::size_t stride = m.position_stride ? m.position_stride : 3 * size;
  if (stride < 3 * size) refuse(fmt::format("mesh: position_stride is {} bytes and needs {}", stride, 3 * size));
  const auto* bytes = m.positions ? reinterpret_cast<const unsigned char*>(m.positions)
                                  : reinterpret_cast<const unsigned char*>(m.positions_double);
  std::vector<glm::dvec3> positions(m.n_positions);
  for (glm::dvec3& x : positions) {
    if (m.positions) {
      float f[3];
      std::memcpy(f, bytes, sizeof f);
      x = {f[0], f[1], f[2]};
    } else {
      std::memcpy(&x, bytes, sizeof x);
    }
    if (!(std::isfinite(x.x) && std::isfinite(x.y) && std::isfinite(x.z)))
      throw Error(ErrorKind::input, fmt::format("mesh: vertex {} is not finite; leave it out", &x - positions.data()));
    bytes += stride;
  }
  return positions;
}

/// Indices out of range are left to clean_mesh.
void warn_of_rounding(PolygonMesh& mesh) {
  Box box;
  for (const std::uint32_t corner : mesh.corners) {
    if (corner >= mesh.points.size()) return;
    box.add(mesh.points[corner]);
  }
  if (std::string line = rounding_warning(mesh.points, box.low, box.high); !line.empty())
    mesh.warnings.push_back(std::move(line));
}

}  // namespace

void refuse(const std::string& what) { throw Error(ErrorKind::usage, what); }

cl::Buffer buffer_of(const Compute& compute, cl_mem handle, const char* what) {
  cl::Buffer b(handle, true);
  if (b.getInfo<CL_MEM_TYPE>() != CL_MEM_OBJECT_BUFFER) refuse(fmt::format("{}: it is no buffer; give one", what));
  if (handle_of<cl_context>(clGetMemObjectInfo, handle, CL_MEM_CONTEXT) != compute.context()())
    refuse(fmt::format("{}: it is of another context than the renderer; create it in that one", what));
  return b;
}

void require_bytes(const cl::Buffer& b, std::size_t offset, std::size_t count, std::size_t stride, std::size_t bytes,
                   const char* what) {
  const std::size_t size = b.getInfo<CL_MEM_SIZE>();
  // In double nothing overflows, and what a buffer may hold is exact.
  const double needed = static_cast<double>(offset) + static_cast<double>(count - 1) * static_cast<double>(stride) +
                        static_cast<double>(bytes);
  if (static_cast<double>(size) < needed)
    refuse(fmt::format("{}: it has {} bytes and needs {:.0f}; make it larger", what, size, needed));
}

Mesh host_mesh(const parian_mesh& m) {
  if (!m.indices) refuse("mesh: indices is NULL; give three for each triangle");
  const std::size_t corners = std::size_t{3} * m.n_triangles;
  if (m.normals_kind == PARIAN_NORMALS_NONE) {
    PolygonMesh polygons;
    polygons.points = host_positions(m);
    polygons.corners.assign(m.indices, m.indices + corners);
    polygons.face_sizes.assign(m.n_triangles, 3);
    if (m.positions) warn_of_rounding(polygons);
    return clean_mesh(std::move(polygons));
  }
  if (!m.normals) refuse("mesh: normals is NULL; give them, or PARIAN_NORMALS_NONE");
  Mesh mesh;
  mesh.positions = host_positions(m);
  mesh.triangles.resize(m.n_triangles);
  std::memcpy(mesh.triangles.data(), m.indices, corners * sizeof(std::uint32_t));
  mesh.normals.reserve(corners);
  for (std::size_t i = 0; i < corners; ++i) {
    if (m.indices[i] >= m.n_positions)
      throw Error(ErrorKind::input, fmt::format("mesh: triangle {} has vertex {} of {}; check the indices", i / 3,
                                                m.indices[i], m.n_positions));
    const float* n = m.normals + 3 * (m.normals_kind == PARIAN_NORMALS_PER_CORNER ? i : m.indices[i]);
    const glm::vec3 normal(n[0], n[1], n[2]);
    if (!(glm::dot(normal, normal) > 0.25F && glm::dot(normal, normal) < 4.0F))
      throw Error(ErrorKind::input, fmt::format("mesh: normal {} of triangle {} isn't of unit length", i % 3, i / 3));
    mesh.normals.push_back(normal);
  }
  mesh.counts.triangles = m.n_triangles;
  return mesh;
}

DeviceMesh device_mesh(const Compute& compute, const parian_mesh& m) {
  if (m.positions || m.positions_double || m.indices || m.normals)
    refuse("mesh: it has both buffers and pointers to host memory; give one kind");
  if (!m.position_buffer || !m.index_buffer) refuse("mesh: one of its two buffers is NULL; give both");
  DeviceMesh mesh{buffer_of(compute, m.position_buffer, "position_buffer"),
                  buffer_of(compute, m.index_buffer, "index_buffer"), words(m.position_offset, "position_offset"),
                  words(m.position_stride ? m.position_stride : 12, "position_stride"),
                  words(m.index_offset, "index_offset")};
  if (mesh.position_stride < 3) refuse("position_stride: it is below the 12 bytes of a position");
  require_bytes(mesh.positions, m.position_offset, m.n_positions, std::size_t{4} * mesh.position_stride, 12,
                "position_buffer");
  require_bytes(mesh.indices, m.index_offset, m.n_triangles, 12, 12, "index_buffer");
  return mesh;
}

Settings settings_of(const parian_settings& s) {
  Settings t;
  t.error = s.error;
  t.layers = s.layers;
  t.layer_size = s.layer_size;
  t.light_map_size = s.light_map_size;
  t.light_map_shift = s.light_map_shift != 0;
  t.samples = s.samples;
  t.model = one_of<Model>(s.model, "settings: model");
  t.estimator = one_of<Estimator>(s.estimator, "settings: estimator");
  t.disc_radius = s.disc_radius;
  t.gather = one_of<Gather>(s.views, "settings: views");
  t.still = s.fixed_cameras != 0;
  if (!t.still && t.gather == Gather::camera)
    refuse("settings: views is PARIAN_CAMERA, where cameras may move; set fixed_cameras too");
  t.pyramids = s.pyramids != 0;
  t.seed = s.seed;
  t.frames = s.frames;
  t.force = s.force != 0;
  t.time_stages = s.time_stages != 0;
  for (std::string names = s.keep ? s.keep : ""; !names.empty();) {
    const std::size_t comma = names.find(',');
    t.keep.insert(names.substr(0, comma));
    names = comma == std::string::npos ? "" : names.substr(comma + 1);
  }
  if (const auto problem = problem_of(t)) refuse("settings: " + problem->text());
  check_kept(t);
  check_samples(t);
  return t;
}

}  // namespace parian
