// Buffers of the mesh and what fills them.
#include "passes/geometry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "passes/passes.hpp"

namespace parian {
namespace {

/// What the rasteriser keeps of a view.
void allocate_records(Passes& p) {
  Geometry& g = p.geometry;
  g.n_records = g.n_triangles * p.plan.records;
  g.records = p.compute.buffer<kernels::RasterTriangle>(std::max(
      std::size_t{g.n_records}, g.n_positions * sizeof(cl_int4) / sizeof(kernels::RasterTriangle) + 1));  // or corners
  g.large = p.compute.buffer<cl_uint>(g.n_records);
  g.n_large = p.compute.buffer<cl_uint>(1);
}

/// Work-items that measure a mesh: each takes many triangles, so that few wait for one another's atomics.
constexpr std::size_t measuring_items = 1024;
constexpr double roomy = 4.0;  // times a mesh's own radius: a quarter of its light map's sides is left for it

/// A centre in two parts, so that a mesh far from the origin keeps the digits that its floats have.
struct Parts {
  kernels::float4 centre, rest;
};
Parts in_parts(glm::dvec3 centre) {
  const kernels::float4 rounded = to_float4(centre);
  return {rounded, to_float4(centre - glm::dvec3(rounded.x, rounded.y, rounded.z))};
}

/// The float that the kernels' ordered() made this of.
float from_ordered(cl_uint bits) { return std::bit_cast<float>(bits >> 31 ? bits ^ 0x80000000U : ~bits); }

/// Measures a mesh in buffers.
class Measurement {
 public:
  Measurement(Compute& c, const DeviceMesh& m, const MeshBounds& counts) : compute_(c), mesh_(m), counts_(counts) {}

  struct Bounds {
    glm::dvec3 low{}, high{};
    double reach = 0.0;  // from `other`
    bool empty = true;
  };
  /// Of triangles that reach no farther than `limit` units from `centre`.
  Bounds bounds(glm::dvec3 centre, double unit, double limit, glm::dvec3 other) {
    Compute::Temporary b(compute_, compute_.upload(std::vector<cl_uint>{~0U, ~0U, ~0U, 0, 0, 0, 0}));
    const Parts c = in_parts(centre), o = in_parts(other);
    launch("geometry_bounds", measuring_items, c.centre, c.rest, static_cast<float>(1.0 / unit),
           static_cast<float>(limit * limit * 1.000001), o.centre, o.rest, b);
    const std::vector<cl_uint> bits = compute_.read<cl_uint>(b, 7);
    compute_.release(b);
    Bounds found;
    for (int i = 0; i < 3; ++i) {
      found.low[i] = from_ordered(bits[i]);
      found.high[i] = from_ordered(bits[3 + i]);
    }
    found.reach = unit * std::sqrt(double{std::bit_cast<float>(bits[6])});
    found.empty = !(found.low.x <= found.high.x);
    return found;
  }

  /// How far, in units, triangles reach from `centre` that hang together with what lies within a unit of it or, if that
  /// isn't half of them, with that half which lies nearest: no gap between them is wider than what lies inside. A
  /// triangle with a corner far off is somebody's mistake.
  double limit(glm::dvec3 centre, double unit) {
    Compute::Temporary b(compute_, compute_.upload(std::vector<cl_uint>(REACH_COUNTS + 1, 0)));
    const Parts c = in_parts(centre);
    launch("geometry_reaches", counts_.triangles, c.centre, c.rest, static_cast<float>(1.0 / unit), b);
    const std::vector<cl_uint> counts = compute_.read<cl_uint>(b, REACH_COUNTS + 1);
    compute_.release(b);
    // Up to which reach, in units, a range goes.
    const auto end = [](std::size_t i) {
      return std::sqrt(double{std::bit_cast<float>(static_cast<cl_uint>((i + 1) << REACH_SHIFT) - 1)});
    };
    const auto grown = [&](double from) {
      for (std::size_t i = 0; i < REACH_COUNTS && end(i) <= 2 * from; ++i)
        if (counts[i] > 0) from = std::max(from, end(i));
      return from;
    };
    const auto within = [&](double reach) {
      std::size_t n = 0;
      for (std::size_t i = 0; i < REACH_COUNTS && end(i) <= reach; ++i) n += counts[i];
      return n;
    };
    std::size_t all = within(INFINITY), half = 0, n = 0;
    while (half < REACH_COUNTS && 2 * (n += counts[half]) < all) ++half;
    const double reach = grown(1.0);
    return 2 * within(reach) >= all ? reach : grown(end(half));
  }

 private:
  template <class... More>
  void launch(const char* name, std::size_t items, const More&... more) {
    compute_.launch(name, items, Stage::plan, static_cast<cl_uint>(counts_.triangles),
                    static_cast<cl_uint>(counts_.positions), mesh_.indices, mesh_.first_index, mesh_.positions,
                    mesh_.first_position, mesh_.position_stride, more...);
  }

  Compute& compute_;
  const DeviceMesh& mesh_;
  const MeshBounds& counts_;
};

/// The smallest sphere that holds two.
ObjectSpace both(const ObjectSpace& a, const ObjectSpace& b) {
  const glm::dvec3 between = b.centre - a.centre;
  const double distance = glm::length(between);
  if (distance + b.radius <= a.radius) return a;
  if (distance + a.radius <= b.radius) return b;
  const double radius = 0.5 * (distance + a.radius + b.radius);
  return {a.centre + between * ((radius - a.radius) / distance), radius};
}

}  // namespace

MeshSphere measure_sphere(Compute& c, const DeviceMesh& m, const MeshBounds& given) {
  Measurement measured(c, m, given);
  MeshSphere sphere{{given.centre, given.radius}, 0.0};
  const bool none = given.radius == 0.0;
  const double unit = none ? 1.0 : given.radius;
  const double limit = none ? INFINITY : measured.limit(given.centre, unit);
  const auto found = measured.bounds(given.centre, unit, limit, given.centre);
  const ObjectSpace own{0.5 * (found.low + found.high), 0.0};
  if (none) {
    const double size = found.empty ? 0.0 : glm::length(found.high - found.low);
    if (!(size > 0.0))
      throw Error(ErrorKind::input, "mesh: no triangle in its buffers has an extent to measure; give a radius above 0");
    sphere.measured = measured.bounds(own.centre, size, INFINITY, own.centre).reach;
    sphere.space = {own.centre, sphere.measured};
  } else if (!found.empty) {
    sphere.measured = measured.bounds(given.centre, unit, limit, own.centre).reach;
    if (found.reach > given.radius * 1.0001)  // rounding aside
      sphere.space = both(sphere.space, {own.centre, sphere.measured});
  }
  return sphere;
}

std::string doubt_of(const MeshSphere& s, const MeshBounds& given) {
  if (given.radius > 0.0 && s.space.radius != given.radius)
    return fmt::format(
        "mesh: the sphere given, of radius {:.4g}, doesn't hold it; planned for one of radius {:.4g} around {:.4g}, "
        "{:.4g}, {:.4g}; give one that holds all positions at all times",
        given.radius, s.space.radius, s.space.centre.x, s.space.centre.y, s.space.centre.z);
  if (s.measured > 0.0 && s.space.radius > roomy * s.measured)
    return fmt::format(
        "mesh: the sphere given, of radius {:.4g}, is large beside it, whose own has {:.4g}: most texels of light maps "
        "and layers lie beside it; give a smaller sphere, or radius 0 to have it measured",
        s.space.radius, s.measured);
  return {};
}

Outside read_outside(Passes& p) {
  const std::vector<cl_uint> bits = p.compute.read<cl_uint>(p.geometry.outside, 2);
  if (bits[0] > 0) p.compute.fill(p.geometry.outside, 0, 2);
  return {bits[0], std::sqrt(double{std::bit_cast<float>(bits[1])})};
}

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
  g.outside = p.compute.upload(std::vector<cl_uint>{0, 0});
  allocate_records(p);
}

void read_geometry(Passes& p, const DeviceMesh& mesh) {
  Geometry& g = p.geometry;
  const Parts c = in_parts(p.plan.space.centre);
  p.compute.launch("geometry_positions", g.n_positions, Stage::light_map, g.n_positions, mesh.positions,
                   mesh.first_position, mesh.position_stride, c.centre, c.rest,
                   static_cast<float>(1.0 / p.plan.space.radius), g.positions);
  p.compute.launch("geometry_triangles", g.n_triangles, Stage::light_map, g.n_triangles, g.n_positions, mesh.indices,
                   mesh.first_index, g.positions, g.triangles, g.outside);
  p.compute.fill(g.normal_sums, 0, std::size_t{3} * g.n_positions);
  p.compute.launch("geometry_normals_add", g.n_triangles, Stage::light_map, g.n_triangles, g.positions, g.triangles,
                   g.normal_sums);
  p.compute.launch("geometry_normals", g.n_triangles, Stage::light_map, g.n_triangles, g.positions, g.triangles,
                   g.normal_sums, g.normals);
  g.set_up.reset();
}

}  // namespace parian
