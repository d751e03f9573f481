// What clean_mesh makes of given normals, and what it and the loading of scenes warn of.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "io/scene_file.hpp"
#include "scene/mesh.hpp"
#include "scene/rounding.hpp"
#include "scratch.hpp"
#include "source_file.hpp"

namespace parian {
namespace {

constexpr double pi = std::numbers::pi;

void add_face(PolygonMesh& mesh, const std::vector<std::uint32_t>& corners) {
  mesh.face_sizes.push_back(static_cast<std::uint32_t>(corners.size()));
  mesh.corners.insert(mesh.corners.end(), corners.begin(), corners.end());
}

/// Appends a ball of quads along `segments` meridians and half as many parallels, outward or inward.
void add_ball(PolygonMesh& mesh, glm::dvec3 centre, double radius, int segments, bool inward = false) {
  const auto base = static_cast<std::uint32_t>(mesh.points.size());
  const int rows = segments / 2;
  for (int i = 0; i <= rows; ++i)
    for (int j = 0; j < segments; ++j) {
      const double theta = pi * i / rows, phi = 2 * pi * j / segments;
      mesh.points.push_back(centre + radius * glm::dvec3(std::sin(theta) * std::cos(phi), std::cos(theta),
                                                         std::sin(theta) * std::sin(phi)));
    }
  for (int j = 0; j < segments; ++j) {  // one point for each pole
    mesh.points[base + j] = centre + glm::dvec3(0, radius, 0);
    mesh.points[base + rows * segments + j] = centre - glm::dvec3(0, radius, 0);
  }
  const auto at = [&](int i, int j) { return base + static_cast<std::uint32_t>(i * segments + j % segments); };
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < segments; ++j) {
      std::vector<std::uint32_t> quad{at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)};
      if (inward) std::reverse(quad.begin(), quad.end());
      add_face(mesh, quad);
    }
}

PolygonMesh ball(int segments) {
  PolygonMesh mesh;
  add_ball(mesh, glm::dvec3(0), 50, segments);
  return mesh;
}

/// A prism along z over a polygon in the x-y plane.
PolygonMesh prism(const std::vector<glm::dvec2>& outline, double height) {
  PolygonMesh mesh;
  const auto n = static_cast<std::uint32_t>(outline.size());
  for (const double z : {0.0, height})
    for (const glm::dvec2& p : outline) mesh.points.emplace_back(p.x, p.y, z);
  std::vector<std::uint32_t> bottom, top;
  for (std::uint32_t i = 0; i < n; ++i) {
    add_face(mesh, {i, (i + 1) % n, n + (i + 1) % n, n + i});
    bottom.insert(bottom.begin(), i);
    top.push_back(n + i);
  }
  add_face(mesh, bottom);
  add_face(mesh, top);
  return mesh;
}

/// The warnings that say `part`, one after the other.
std::string said(const Mesh& mesh, const std::string& part) {
  std::string all;
  for (const std::string& warning : mesh.warnings)
    if (warning.find(part) != std::string::npos) all += warning;
  return all;
}

glm::dvec3 corner(const Mesh& mesh, std::size_t h) {
  return mesh.positions[mesh.triangles[h / 3][static_cast<int>(h % 3)]];
}

/// Gives each point of a ball round the origin a normal that no triangle has: radial, but twisted round y.
void twist(PolygonMesh& mesh, double sign) {
  for (const glm::dvec3& p : mesh.points) mesh.normals.emplace_back(sign * (p + 0.3 * glm::dvec3(p.z, 0, -p.x)));
}

void expect_twisted(const Mesh& mesh, const std::string& what) {
  double worst = 0;
  for (std::size_t h = 0; h < mesh.normals.size(); ++h) {
    const glm::dvec3 p = corner(mesh, h), n = glm::normalize(p + 0.3 * glm::dvec3(p.z, 0, -p.x));
    worst = std::max(worst, glm::distance(n, glm::dvec3(mesh.normals[h])));
  }
  EXPECT_LT(worst, 1e-6) << what;  // float rounding
}

TEST(GivenNormals, AreUsedAsTheyAre) {
  for (const bool inward : {false, true})         // turned by clean_mesh
    for (const double sign : {1.0, -1.0, 7.0}) {  // into the part, or of any length
      PolygonMesh mesh;
      add_ball(mesh, glm::dvec3(0), 50, 24, inward);
      twist(mesh, sign);
      const Mesh clean = clean_mesh(mesh);
      expect_twisted(clean, inward ? "inward" : "outward");
      EXPECT_EQ(clean.counts.parts_turned, inward ? 1U : 0U);
      EXPECT_EQ(said(clean, "no normal"), "");
    }
}

TEST(GivenNormals, OfCornersGoWithThem) {
  PolygonMesh mesh = ball(12), by_corner = mesh;
  twist(mesh, 1);
  // The same normals in reverse order, named by corner.
  by_corner.normals.assign(mesh.normals.rbegin(), mesh.normals.rend());
  for (const std::uint32_t point : mesh.corners)
    by_corner.corner_normals.push_back(static_cast<std::uint32_t>(mesh.normals.size()) - 1 - point);
  const Mesh a = clean_mesh(mesh), b = clean_mesh(by_corner);
  EXPECT_EQ(a.normals, b.normals);
  EXPECT_EQ(a.triangles, b.triangles);
}

TEST(GivenNormals, SurviveTriangulationAndSlivers) {
  // Two squares beside each other, one of whose edges has a point more that a sliver closes; normals lean by x.
  PolygonMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {1, 0.5, 0}, {2, 0, 0}, {2, 1, 0}};
  add_face(mesh, {0, 1, 2, 3});
  add_face(mesh, {1, 4, 2});
  add_face(mesh, {1, 5, 4});
  add_face(mesh, {5, 6, 4});
  add_face(mesh, {6, 2, 4});
  for (const glm::dvec3& p : mesh.points) mesh.normals.emplace_back(0.2 * p.x - 0.1, 0.3 * p.y, 1);
  const Mesh clean = clean_mesh(mesh);
  EXPECT_EQ(clean.counts.boundary_edges, 6U);
  for (std::size_t h = 0; h < clean.normals.size(); ++h) {
    const glm::dvec3 p = corner(clean, h), n = glm::normalize(glm::dvec3(0.2 * p.x - 0.1, 0.3 * p.y, 1));
    EXPECT_LT(glm::distance(n, glm::dvec3(clean.normals[h])), 1e-6) << "corner " << h;
  }
}

TEST(GivenNormals, OfNoUseAreComputedAndCounted) {
  const PolygonMesh plain = ball(48);
  const Mesh computed = clean_mesh(plain);
  PolygonMesh mesh = plain;
  twist(mesh, 1);
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  constexpr std::size_t row = 48 * 12;
  constexpr std::array<std::size_t, 4> spoilt{0, 2, 4, 6};
  mesh.normals[row] = glm::vec3(nan, 0, 1);
  mesh.normals[row + 2] = glm::vec3(0);
  mesh.normals[row + 4] = glm::vec3(inf, 0, 0);
  mesh.normals[row + 6] = -mesh.normals[row + 6];
  const Mesh clean = clean_mesh(mesh);
  std::size_t bad = 0;
  for (std::size_t h = 0; h < clean.normals.size(); ++h) {
    const bool of_no_use = std::any_of(spoilt.begin(), spoilt.end(),
                                       [&](std::size_t i) { return corner(clean, h) == mesh.points[row + i]; });
    if (!of_no_use) continue;
    ++bad;
    EXPECT_EQ(clean.normals[h], computed.normals[h]);
  }
  EXPECT_GT(bad, 4U);
  EXPECT_NE(said(clean, "no normal").find(std::to_string(bad) + " have no normal"), std::string::npos)
      << said(clean, "no normal");
}

TEST(GivenNormals, TurnWithTheObject) {
  const test::Scratch scratch;
  scratch.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 3 0 4\nf 1//1 2//1 3//1\n");
  const auto scene = scratch.write("a.toml", "[[object]]\nmesh = \"a.obj\"\nrotate = [0, 90, 0]\n");
  const Mesh mesh = load_input(scene, {}).scene.mesh;
  ASSERT_EQ(mesh.normals.size(), 3U);
  EXPECT_LT(glm::distance(mesh.normals[0], glm::vec3(0.8, 0, -0.6)), 1e-6F);  // x goes to -z, z to x
}

TEST(MeshWarnings, APartInsideAnotherIsSaidWithBothSizes) {
  for (const bool cavity : {false, true}) {
    PolygonMesh hollow;
    add_ball(hollow, {1000, 0, 0}, 48, 48, cavity);
    add_ball(hollow, {1000, 0, 0}, 50, 48);
    add_ball(hollow, {1200, 0, 0}, 50, 48);
    const std::string line = said(clean_mesh(hollow), "lies inside another");
    EXPECT_NE(line.find("one of 96 x 96 x 96 mm in one of 100 x 100 x 100 mm"), std::string::npos) << line;
  }
  PolygonMesh many;
  add_ball(many, glm::dvec3(0), 50, 48);
  for (const double x : {-20.0, 0.0, 20.0}) add_ball(many, {x, 0, 0}, 5 + 0.1 * x, 24, true);
  const std::string line = said(clean_mesh(many), "inside another");
  EXPECT_NE(line.find("3 closed parts lie inside another, the largest of 14 x 14 x 14 mm in"), std::string::npos)
      << line;
}

TEST(MeshWarnings, PartsBesideEachOtherAreNotInside) {
  PolygonMesh beside;
  add_ball(beside, glm::dvec3(0), 50, 48);
  add_ball(beside, glm::dvec3(36), 3, 48);  // in the corner of its box
  add_ball(beside, glm::dvec3(28), 4, 48);  // pokes out
  add_ball(beside, {0, 48, 0}, 5, 48);      // and of its box too
  EXPECT_EQ(said(clean_mesh(beside), "inside another"), "");
  PolygonMesh open = ball(48);  // an open bowl round a ball isn't closed
  open.face_sizes.resize(open.face_sizes.size() - 48);
  open.corners.resize(open.corners.size() - std::size_t{4} * 48);
  add_ball(open, glm::dvec3(0), 5, 24);
  EXPECT_EQ(said(clean_mesh(open), "inside another"), "");
}

TEST(MeshWarnings, CoarseMeshesWithSmoothNormalsShowFacets) {
  const std::string line = said(clean_mesh(ball(24)), "coarse mesh");
  EXPECT_NE(line.find("15 degrees between neighbouring triangles"), std::string::npos) << line;
  EXPECT_NE(line.find("subdivide"), std::string::npos) << line;
  EXPECT_EQ(said(clean_mesh(ball(64)), "coarse mesh"), "");
  std::vector<glm::dvec2> circle, hexagon, rounded;
  for (int i = 0; i < 24; ++i) circle.emplace_back(50 * std::cos(2 * pi * i / 24), 50 * std::sin(2 * pi * i / 24));
  for (int i = 0; i < 6; ++i) hexagon.emplace_back(50 * std::cos(2 * pi * i / 6), 50 * std::sin(2 * pi * i / 6));
  for (int i = 0; i < 16; ++i) {  // a square whose corners are round, in four steps of 22.5 degrees each
    const double angle = 2 * pi * (i + 0.5) / 16 - pi / 4 + (pi / 8 - pi / 16);
    const glm::dvec2 centre = 45.0 * glm::dvec2(i / 4 == 0 || i / 4 == 3 ? 1 : -1, i / 4 < 2 ? 1 : -1);
    rounded.push_back(centre + 5.0 * glm::dvec2(std::cos(angle + pi / 8), std::sin(angle + pi / 8)));
  }
  EXPECT_NE(said(clean_mesh(prism(circle, 100)), "coarse mesh"), "");   // a cylinder's side is meant to be round
  EXPECT_EQ(said(clean_mesh(prism(hexagon, 100)), "coarse mesh"), "");  // creases
  EXPECT_EQ(said(clean_mesh(prism(rounded, 100)), "coarse mesh"), "");
  // Given normals that are the triangles' own mean facets; ones that smooth don't make them go away.
  PolygonMesh smooth = ball(24);
  for (const glm::dvec3& p : smooth.points) smooth.normals.emplace_back(p);
  EXPECT_NE(said(clean_mesh(smooth), "coarse mesh"), "");
  PolygonMesh flat = ball(24);
  flat.normals.clear();
  std::size_t begin = 0;
  for (const std::uint32_t size : flat.face_sizes) {
    glm::dvec3 sum(0);
    for (std::uint32_t i = 0; i < size; ++i) sum += flat.points[flat.corners[begin + i]];
    flat.corner_normals.insert(flat.corner_normals.end(), size, static_cast<std::uint32_t>(flat.normals.size()));
    flat.normals.emplace_back(sum);
    begin += size;
  }
  EXPECT_EQ(said(clean_mesh(flat), "coarse mesh"), "");
}

TEST(MeshWarnings, ShippedModelsHaveNone) {
  for (const char* name : {"figure", "torus", "sphere", "slab", "concave"}) {
    const Input input = load_input(test::source_file(std::string("meshes/") + name + ".ply"), {});
    EXPECT_EQ(input.scene.mesh.warnings, std::vector<std::string>()) << name;
  }
}

std::string rounding(PolygonMesh mesh) {
  glm::dvec3 low(INFINITY), high(-INFINITY);
  for (const glm::dvec3& p : mesh.points) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  return rounding_warning(mesh.points, low, high);
}

PolygonMesh placed(glm::dvec3 offset, bool single) {
  PolygonMesh mesh = ball(24);
  for (glm::dvec3& p : mesh.points) {
    p += offset;
    for (int axis = 0; single && axis < 3; ++axis) {
      const volatile float rounded = static_cast<float>(p[axis]);  // GCC 12 forgets to round dvec3(vec3(p))
      p[axis] = static_cast<double>(rounded);
    }
  }
  return mesh;
}

TEST(MeshWarnings, FloatsAtMapCoordinatesAreAStaircase) {
  const glm::dvec3 utm(500000, 5400000, 300);
  const std::string line = rounding(placed(utm, true));
  EXPECT_NE(line.find("y of up to 5.4e+06 comes in steps of 0.5"), std::string::npos) << line;
  EXPECT_NE(line.find("single precision"), std::string::npos) << line;
  EXPECT_EQ(rounding(placed(utm, false)), "");  // doubles
  EXPECT_EQ(rounding(placed({0, 0, 0}, true)), "");
  EXPECT_EQ(rounding(placed({1000, -2000, 3000}, true)), "");  // steps of 1/4096 in a box of 100
  PolygonMesh whole = placed(utm, true);
  for (glm::dvec3& p : whole.points) p = 2.0 * glm::round(0.5 * p);  // exact on a coarser grid
  EXPECT_EQ(rounding(whole), "");
}

TEST(MeshWarnings, AFileOfFloatsAtMapCoordinatesIsSaid) {
  const test::Scratch scratch;
  const PolygonMesh mesh = placed({500000, 5400000, 300}, true);
  std::string text =
      "OFF\n" + std::to_string(mesh.points.size()) + " " + std::to_string(mesh.face_sizes.size()) + " 0\n";
  for (const glm::dvec3& p : mesh.points)  // all digits of a float are in six decimals here
    text += std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z) + "\n";
  for (std::size_t i = 0; i < mesh.corners.size(); ++i)
    text += (i % 4 == 0 ? "4 " : "") + std::to_string(mesh.corners[i]) + (i % 4 == 3 ? "\n" : " ");
  const Input input = load_input(scratch.write("a.off", text), {});
  EXPECT_NE(said(input.scene.mesh, "comes in steps of"), "");
}

}  // namespace
}  // namespace parian
