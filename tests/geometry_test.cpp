// A mesh read on the device from its owner's buffers, against the same in double: positions, safe triangles, normals.
#include <gtest/gtest.h>

#include "test_scene.hpp"

namespace parian::test {
namespace {

constexpr std::uint32_t side = 24;

/// A bumpy sheet far from the origin, one step of 90 degrees across it, and what doesn't belong into a mesh.
struct Sheet {
  std::vector<float> positions;              // five floats a vertex, the first of which isn't its own
  std::vector<std::uint32_t> corners{7, 7};  // two words that aren't the mesh's
  glm::dvec3 centre{1000.0, -2000.0, 500.0};
  double radius = 20.0;

  Sheet() {
    for (std::uint32_t y = 0; y < side; ++y)
      for (std::uint32_t x = 0; x < side; ++x) {
        const double u = x - 0.5 * side, v = y - 0.5 * side, step = x > side / 2 ? x - side / 2.0 : 0.0;
        const glm::dvec3 p = centre + glm::dvec3(u - step, 0.3 * std::sin(u) * std::cos(0.7 * v) + step, v);
        for (const double value : {9.0, p.x, p.y, p.z, 9.0}) positions.push_back(static_cast<float>(value));
      }
    for (std::uint32_t y = 0; y + 1 < side; ++y)
      for (std::uint32_t x = 0; x + 1 < side; ++x) {
        const std::uint32_t a = y * side + x;
        for (const std::uint32_t c : {a, a + side, a + 1, a + 1, a + side, a + side + 1}) corners.push_back(c);
      }
  }
  [[nodiscard]] std::uint32_t vertices() const { return static_cast<std::uint32_t>(positions.size() / 5); }
  [[nodiscard]] std::uint32_t triangles() const { return static_cast<std::uint32_t>(corners.size() / 3); }
  [[nodiscard]] glm::dvec3 point(std::uint32_t i) const {
    return (glm::dvec3(positions[5 * i + 1], positions[5 * i + 2], positions[5 * i + 3]) - centre) / radius;
  }
  [[nodiscard]] glm::uvec3 triangle(std::uint32_t i) const {
    return {corners[3 * i + 2], corners[3 * i + 3], corners[3 * i + 4]};
  }
};

/// The passes' geometry of a sheet.
struct Read {
  explicit Read(const Sheet& sheet) {
    Scene scene;
    scene.on_device = {sheet.vertices(), sheet.triangles(), sheet.centre, sheet.radius};
    scene.material = {"test", glm::dvec3(1.0), glm::dvec3(0.1), glm::dvec3(0.0), 1.3};
    scene.lights.emplace_back();
    scene.cameras.push_back({sheet.centre + glm::dvec3(0, 0, 100), sheet.centre});
    Settings settings;
    settings.still = false;
    const Plan plan = make_plan(scene, settings, opened().info());
    const std::shared_ptr<Compute> shared = built(plan.options);
    Compute& compute = *shared;
    Passes passes(compute, plan);
    allocate_geometry(passes, sheet.vertices(), sheet.triangles());
    read_geometry(passes, {compute.upload(sheet.positions), compute.upload(sheet.corners), 1, 5, 2});
    positions = compute.read<kernels::float4>(passes.geometry.positions, sheet.vertices());
    triangles = compute.read<cl_uint>(passes.geometry.triangles, std::size_t{3} * sheet.triangles());
    normals = compute.read<float>(passes.geometry.normals, std::size_t{9} * sheet.triangles());
  }
  std::vector<kernels::float4> positions;
  std::vector<cl_uint> triangles;
  std::vector<float> normals;
};

TEST(Geometry, ReadsPositionsTrianglesAndNormals) {
  const Sheet sheet;
  const Read read(sheet);
  // (x - centre) / radius in float32, the difference of two floats nearly exact: a few roundings of values below 1.
  Worst position;
  for (std::uint32_t i = 0; i < sheet.vertices(); ++i) {
    ASSERT_EQ(read.positions[i].w, 1.0F);
    position.add(glm::length(exact(read.positions[i]) - sheet.point(i)), [&] { return hex(sheet.point(i)); });
  }
  fmt::print("positions: worst error {:.2g} at {}\n", position.value, position.where);
  EXPECT_LE(position.value, 2.5e-7);

  std::vector<glm::dvec3> smooth(sheet.vertices(), glm::dvec3(0));
  std::vector<glm::dvec3> flat;
  for (std::uint32_t t = 0; t < sheet.triangles(); ++t) {
    const glm::uvec3 c = sheet.triangle(t);
    const glm::dvec3 p[3] = {sheet.point(c[0]), sheet.point(c[1]), sheet.point(c[2])};
    flat.push_back(glm::normalize(glm::cross(p[1] - p[0], p[2] - p[0])));
    for (int k = 0; k < 3; ++k) {
      ASSERT_EQ(read.triangles[3 * t + k], c[k]);
      const glm::dvec3 a = glm::normalize(p[(k + 1) % 3] - p[k]), b = glm::normalize(p[(k + 2) % 3] - p[k]);
      smooth[c[k]] += std::acos(glm::dot(a, b)) * flat.back();
    }
  }
  Worst normal;
  std::size_t split = 0, undecided = 0;
  for (std::uint32_t t = 0; t < sheet.triangles(); ++t)
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 vertex = glm::normalize(smooth[sheet.triangle(t)[k]]);
      const double bend = glm::dot(vertex, flat[t]) - std::cos(glm::radians(40.0));
      const bool sharp = bend < 0;
      split += sharp;
      if (std::abs(bend) < 1e-4) {
        ++undecided;
        continue;
      }
      const float* n = &read.normals[9 * t + 3 * k];
      normal.add(glm::length(glm::dvec3(n[0], n[1], n[2]) - (sharp ? flat[t] : vertex)),
                 [&] { return fmt::format("corner {} of triangle {}", k, t); });
    }
  fmt::print("normals: {} of {} corners split, worst error {:.2g} at {}\n", split, 3 * sheet.triangles(), normal.value,
             normal.where);
  EXPECT_LE(undecided, 2U);
  EXPECT_GT(split, side);
  // Positions are rounded by 4e-8 at edges 0.05 long, which turns a normal by 1e-6 or two.
  EXPECT_LE(normal.value, 3e-6);
}

TEST(Geometry, LeavesOutWhatIsNoTriangle) {
  Sheet sheet;
  const std::uint32_t bad_vertex = 3 * side + 5, bad_triangle = 40;
  sheet.positions[5 * bad_vertex + 2] = std::numeric_limits<float>::quiet_NaN();
  sheet.positions[5 * (bad_vertex + 2 * side) + 3] = std::numeric_limits<float>::infinity();
  sheet.corners[3 * bad_triangle + 3] = sheet.vertices();
  const Read read(sheet);
  std::size_t left_out = 0;
  for (std::uint32_t t = 0; t < sheet.triangles(); ++t) {
    bool sound = true;
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t c = sheet.triangle(t)[k];
      sound = sound && c < sheet.vertices() && c != bad_vertex && c != bad_vertex + 2 * side;
    }
    left_out += !sound;
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(read.triangles[3 * t + k], sound ? sheet.triangle(t)[k] : 0U) << t;
      for (int c = 0; c < 3; ++c) EXPECT_TRUE(std::isfinite(read.normals[9 * t + 3 * k + c])) << t;
    }
  }
  EXPECT_EQ(left_out, 13U);  // six around each vertex, and one
  for (const kernels::float4& p : read.positions) EXPECT_TRUE(std::isfinite(p.x + p.y + p.z + p.w));
}

}  // namespace
}  // namespace parian::test
