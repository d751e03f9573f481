// clean_mesh on small meshes whose right answer is known.
#include "scene/mesh.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>

#include "core/error.hpp"
#include "scene/triangulate.hpp"

namespace {

using parian::clean_mesh;
using parian::Mesh;
using parian::PolygonMesh;

void add_face(PolygonMesh& mesh, const std::vector<std::uint32_t>& corners) {
  mesh.face_sizes.push_back(static_cast<std::uint32_t>(corners.size()));
  mesh.corners.insert(mesh.corners.end(), corners.begin(), corners.end());
}

PolygonMesh triangles(const std::vector<glm::dvec3>& points, const std::vector<std::vector<std::uint32_t>>& faces) {
  PolygonMesh mesh{points, {}, {}};
  for (const auto& face : faces) add_face(mesh, face);
  return mesh;
}

/// Appends a cube of quads that faces outward, or inward.
void add_cube(PolygonMesh& mesh, const glm::dvec3& centre, double half, bool inward) {
  const auto base = static_cast<std::uint32_t>(mesh.points.size());
  for (int i = 0; i < 8; ++i)
    mesh.points.push_back(centre + half * glm::dvec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  const std::array<std::array<std::uint32_t, 4>, 6> quads{
      {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
  for (auto quad : quads) {
    if (inward) std::reverse(quad.begin(), quad.end());
    add_face(mesh, {base + quad[0], base + quad[1], base + quad[2], base + quad[3]});
  }
}

PolygonMesh cube(bool inward = false) {
  PolygonMesh mesh;
  add_cube(mesh, glm::dvec3(0.5), 0.5, inward);
  return mesh;
}

/// A subdivided octahedron pushed onto the unit sphere; edges are shared by index only after clean_mesh joins points.
PolygonMesh sphere(int n) {
  PolygonMesh mesh;
  for (int octant = 0; octant < 8; ++octant) {
    const glm::dvec3 sign(octant & 1 ? -1 : 1, octant & 2 ? -1 : 1, octant & 4 ? -1 : 1);
    const bool mirrored = sign.x * sign.y * sign.z < 0;
    const auto point = [&](int i, int j) {
      const glm::dvec3 p = sign * glm::dvec3(n - i - j, i, j);
      mesh.points.push_back(p / glm::length(p));
      return static_cast<std::uint32_t>(mesh.points.size() - 1);
    };
    const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      mirrored ? add_face(mesh, {a, c, b}) : add_face(mesh, {a, b, c});
    };
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n - i; ++j) {
        triangle(point(i, j), point(i + 1, j), point(i, j + 1));
        if (i + j + 1 < n) triangle(point(i + 1, j), point(i + 1, j + 1), point(i, j + 1));
      }
  }
  return mesh;
}

double volume(const Mesh& mesh) {
  double sum = 0.0;
  for (const glm::uvec3& t : mesh.triangles)
    sum += glm::dot(mesh.positions[t[0]], glm::cross(mesh.positions[t[1]], mesh.positions[t[2]])) / 6.0;
  return sum;
}

double area(const Mesh& mesh) {
  double sum = 0.0;
  for (const glm::uvec3& t : mesh.triangles)
    sum += 0.5 * glm::length(glm::cross(mesh.positions[t[1]] - mesh.positions[t[0]],
                                        mesh.positions[t[2]] - mesh.positions[t[0]]));
  return sum;
}

TEST(CleanMesh, CubeOfQuads) {
  const Mesh mesh = clean_mesh(cube());
  EXPECT_EQ(mesh.positions.size(), 8U);
  EXPECT_EQ(mesh.triangles.size(), 12U);
  EXPECT_TRUE(mesh.closed);
  EXPECT_TRUE(mesh.warnings.empty());
  EXPECT_EQ(mesh.counts.faces_read, 6U);
  EXPECT_EQ(mesh.counts.parts, 1U);
  EXPECT_EQ(mesh.counts.parts_turned, 0U);
  EXPECT_DOUBLE_EQ(volume(mesh), 1.0);
}

TEST(CleanMesh, CreaseKeepsCubeSharp) {
  const Mesh mesh = clean_mesh(cube());
  std::map<std::uint32_t, std::vector<glm::vec3>> normals;
  for (std::size_t h = 0; h < mesh.normals.size(); ++h) {
    auto& list = normals[mesh.triangles[h / 3][static_cast<int>(h % 3)]];
    if (std::find(list.begin(), list.end(), mesh.normals[h]) == list.end()) list.push_back(mesh.normals[h]);
  }
  for (const auto& [point, list] : normals) EXPECT_EQ(list.size(), 3U) << point;
  // Beyond the crease of 90 degrees everything is smooth: a corner's three faces weigh the same by their angles.
  const Mesh smooth = clean_mesh(cube(), 91.0);
  for (std::size_t h = 0; h < smooth.normals.size(); ++h) {
    const glm::dvec3 p = smooth.positions[smooth.triangles[h / 3][static_cast<int>(h % 3)]] - glm::dvec3(0.5);
    EXPECT_LT(glm::distance(glm::dvec3(smooth.normals[h]), p / glm::length(p)), 1e-6);  // float rounding
  }
}

void expect_radial_normals(std::size_t n) {
  const Mesh mesh = clean_mesh(sphere(static_cast<int>(n)));
  EXPECT_TRUE(mesh.closed);
  ASSERT_EQ(mesh.triangles.size(), 8 * n * n);
  EXPECT_EQ(mesh.positions.size(), 4 * n * n + 2);
  EXPECT_GT(mesh.counts.duplicate_points, 0U);
  double worst = 0.0;
  double worst_flat = 0.0;
  for (std::size_t h = 0; h < mesh.normals.size(); ++h) {
    const glm::uvec3& t = mesh.triangles[h / 3];
    const glm::dvec3 radial = mesh.positions[t[static_cast<int>(h % 3)]];
    const glm::dvec3 flat = glm::normalize(
        glm::cross(mesh.positions[t[1]] - mesh.positions[t[0]], mesh.positions[t[2]] - mesh.positions[t[0]]));
    EXPECT_NEAR(glm::length(mesh.normals[h]), 1.0F, 1e-6F);
    worst = std::max(worst, std::acos(std::min(1.0, glm::dot(radial, glm::dvec3(mesh.normals[h])))));
    worst_flat = std::max(worst_flat, std::acos(std::min(1.0, glm::dot(radial, flat))));
  }
  EXPECT_LT(worst, std::numbers::pi / 180.0);
  EXPECT_LT(worst, 0.3 * worst_flat);
}

TEST(CleanMesh, SphereNormalsAreNearlyRadial) {
  expect_radial_normals(16);
  expect_radial_normals(100);  // of so many triangles that threads share them
}

TEST(CleanMesh, OrderOfTrianglesDoesNotMatter) {
  const PolygonMesh whole = sphere(12);
  const Mesh expected = clean_mesh(whole);
  std::vector<std::size_t> order(whole.face_sizes.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), std::mt19937(3));
  PolygonMesh shuffled{whole.points, {}, {}};
  for (const std::size_t f : order)
    add_face(shuffled, {whole.corners[3 * f + 1], whole.corners[3 * f + 2], whole.corners[3 * f]});
  const Mesh mesh = clean_mesh(shuffled);
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_LT(glm::distance(mesh.normals[3 * i + k], expected.normals[3 * order[i] + (k + 1) % 3]), 1e-6F);
}

TEST(CleanMesh, FarFromTheOrigin) {
  PolygonMesh far = sphere(12);
  const Mesh expected = clean_mesh(far);
  for (glm::dvec3& p : far.points) p += glm::dvec3(1e6, -1e6, 1e6);
  const Mesh mesh = clean_mesh(far);
  ASSERT_EQ(mesh.normals.size(), expected.normals.size());
  // Positions move by 1e6 eps / 2 = 1.2e-10, edges are 0.1 long: normals turn by a few 1e-9, below float's 6e-8.
  for (std::size_t i = 0; i < mesh.normals.size(); ++i)
    EXPECT_LT(glm::distance(mesh.normals[i], expected.normals[i]), 5e-7F);
  EXPECT_TRUE(mesh.closed);
}

TEST(CleanMesh, DuplicatesUnreferencedAndZeroArea) {
  const PolygonMesh input = triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-0.0, 0, 0}, {9, 9, 9}, {1, 1, 0}, {2, 0, 0}},
                                      {{0, 1, 2}, {2, 1, 5}, {0, 3, 1}, {0, 1, 6}, {1, 1, 2}, {3, 2, 2, 0}});
  const Mesh mesh = clean_mesh(input);
  EXPECT_EQ(mesh.triangles.size(), 2U);
  EXPECT_EQ(mesh.positions.size(), 4U);
  EXPECT_EQ(mesh.counts.points_read, 7U);
  EXPECT_EQ(mesh.counts.duplicate_points, 1U);
  EXPECT_EQ(mesh.counts.unreferenced_points, 2U);  // the far one, and the one that only a zero-area face names
  EXPECT_EQ(mesh.counts.zero_area_faces, 4U);
  // A thin triangle with an area stays, at any scale.
  for (const double scale : {1e-12, 1.0, 1e12}) {
    const PolygonMesh thin = triangles({{0, 0, 0}, {scale, 0, 0}, {0.3 * scale, 1e-12 * scale, 0}}, {{0, 1, 2}});
    EXPECT_EQ(clean_mesh(thin).triangles.size(), 1U);
  }
}

TEST(CleanMesh, SliversThatCloseASeamLeaveItClosed) {
  // A tetrahedron with two corners on one edge, seen by one of its two triangles only; slivers fill the gap.
  const PolygonMesh seam = triangles({{0, 0, 0}, {3, 0, 0}, {0, 3, 0}, {0, 0, 3}, {1, 0, 0}, {2, 0, 0}}, {{0, 2, 4},
                                                                                                          {4, 2, 5},
                                                                                                          {5, 2, 1},
                                                                                                          {0, 1, 3},
                                                                                                          {0, 3, 2},
                                                                                                          {1, 2, 3},  //
                                                                                                          {0, 4, 1},
                                                                                                          {4, 5, 1}});
  const Mesh mesh = clean_mesh(seam);
  EXPECT_TRUE(mesh.closed);
  EXPECT_EQ(mesh.triangles.size(), 8U);
  EXPECT_EQ(mesh.counts.zero_area_faces, 0U);
  EXPECT_DOUBLE_EQ(volume(mesh), 4.5);
  EXPECT_NEAR(area(mesh), 3 * 4.5 + 4.5 * std::sqrt(3.0), 1e-12);
}

TEST(CleanMesh, Refuses) {
  const auto message = [](const PolygonMesh& input) -> std::string {
    try {
      (void)clean_mesh(input);
    } catch (const parian::Error& e) {
      EXPECT_EQ(e.kind(), parian::ErrorKind::input);
      return e.what();
    }
    return "no error";
  };
  const std::vector<glm::dvec3> three{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_NE(message({three, {}, {}}).find("no faces"), std::string::npos);
  EXPECT_NE(message(triangles(three, {{0, 1, 3}})).find("names point 3 of 3"), std::string::npos);
  EXPECT_NE(message(triangles(three, {{0, 1}})).find("has 2 corners"), std::string::npos);
  EXPECT_NE(message({three, {4}, {0, 1, 2}}).find("need 4 corners"), std::string::npos);
  EXPECT_NE(message(triangles({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}})).find("has an area"), std::string::npos);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    EXPECT_NE(message(triangles({{0, 0, 0}, {1, bad, 0}, {0, 1, 0}}, {{0, 1, 2}})).find("point 1 is"),
              std::string::npos);
}

TEST(CleanMesh, TurnsInwardPartsAndKeepsCavities) {
  const Mesh inward = clean_mesh(cube(true));
  EXPECT_EQ(inward.counts.parts_turned, 1U);
  EXPECT_DOUBLE_EQ(volume(inward), 1.0);
  EXPECT_GT(glm::dot(glm::dvec3(inward.normals[0]), inward.positions[inward.triangles[0][0]] - glm::dvec3(0.5)), 0.0);

  for (const bool inverted : {false, true}) {
    PolygonMesh hollow;  // a shell with a cavity, and in it a kernel; and all of it turned round
    add_cube(hollow, {0, 0, 0}, 1.0, inverted);
    add_cube(hollow, {0, 0, 0}, 0.5, !inverted);
    add_cube(hollow, {0, 0, 0}, 0.25, inverted);
    add_cube(hollow, {5, 0, 0}, 0.5, false);
    const Mesh mesh = clean_mesh(hollow);
    EXPECT_EQ(mesh.counts.parts, 4U);
    EXPECT_EQ(mesh.counts.parts_turned, inverted ? 3U : 0U);
    EXPECT_DOUBLE_EQ(volume(mesh), 8.0 - 1.0 + 0.125 + 1.0);
    EXPECT_TRUE(mesh.closed);
  }
  // inward, within the box of a larger part but not within the part
  PolygonMesh beside =
      triangles({{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {0, 0, 4}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}});
  add_cube(beside, glm::dvec3(3.0), 0.5, true);
  EXPECT_EQ(clean_mesh(beside).counts.parts_turned, 1U);
}

TEST(CleanMesh, Open) {
  PolygonMesh open = cube();
  open.face_sizes.pop_back();
  open.corners.resize(open.corners.size() - 4);
  const Mesh mesh = clean_mesh(open);
  EXPECT_FALSE(mesh.closed);
  EXPECT_EQ(mesh.counts.boundary_edges, 4U);
  ASSERT_EQ(mesh.warnings.size(), 1U);
  EXPECT_NE(mesh.warnings[0].find("4 boundary edges"), std::string::npos);
}

TEST(CleanMesh, NonManifoldEdgesLoseNoFace) {
  const PolygonMesh fan =
      triangles({{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}}, {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}});
  const Mesh mesh = clean_mesh(fan);
  EXPECT_EQ(mesh.triangles.size(), 3U);
  EXPECT_EQ(mesh.counts.non_manifold_edges, 1U);
  EXPECT_EQ(mesh.counts.boundary_edges, 6U);
  EXPECT_EQ(mesh.counts.parts, 1U);
  EXPECT_FALSE(mesh.closed);
  EXPECT_EQ(mesh.warnings.size(), 2U);
  const Mesh disagree = clean_mesh(triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {{0, 1, 2}, {1, 2, 3}}));
  EXPECT_EQ(disagree.counts.non_manifold_edges, 1U);
  const Mesh twice = clean_mesh(triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {2, 1, 0}, {0, 1, 2}}));
  EXPECT_EQ(twice.triangles.size(), 3U);
  EXPECT_EQ(twice.counts.non_manifold_edges, 3U);
}

TEST(CleanMesh, ConcavePolygons) {
  // An arrow head whose fan from the first corner would leave the polygon, in a plane of its own.
  const auto place = [](const std::vector<glm::dvec2>& outline) {
    PolygonMesh mesh;
    std::vector<std::uint32_t> face;
    const glm::dvec3 u = glm::normalize(glm::dvec3(1, 2, 3));
    const glm::dvec3 v = glm::normalize(glm::cross(u, glm::dvec3(0, 1, 0)));
    for (const glm::dvec2& p : outline) {
      face.push_back(static_cast<std::uint32_t>(mesh.points.size()));
      mesh.points.push_back(p.x * u + p.y * v);
    }
    add_face(mesh, face);
    return clean_mesh(mesh);
  };
  EXPECT_NEAR(area(place({{0, 0}, {2, -1}, {0.5, 0}, {2, 1}})), 0.5, 1e-12);
  EXPECT_NEAR(area(place({{2, 1}, {0, 0}, {2, -1}, {0.5, 0}})), 0.5, 1e-12);
  EXPECT_NEAR(area(place({{0, 0}, {4, 0}, {4, 3}, {3, 3}, {3, 1}, {1, 1}, {1, 3}, {0, 3}})), 8.0, 1e-12);  // U
  const Mesh straight = place({{0, 0}, {1, 0}, {2, 0}, {2, 2}, {0, 2}});  // a corner on a straight edge
  EXPECT_NEAR(area(straight), 4.0, 1e-12);
  EXPECT_EQ(straight.triangles.size(), 3U);
  EXPECT_EQ(straight.counts.boundary_edges, 5U);
  std::vector<glm::dvec2> star;
  for (int i = 0; i < 200; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 200.0;
    star.push_back((i % 2 ? 1.0 : 0.2) * glm::dvec2(std::cos(angle), std::sin(angle)));
  }
  EXPECT_NEAR(area(place(star)), 200 * 0.5 * 0.2 * std::sin(std::numbers::pi / 100.0), 1e-12);
  EXPECT_EQ(place(star).triangles.size(), 198U);
  const Mesh bow = place({{0, 0}, {1, 1}, {1, 0}, {0, 1}, {-1, 0.5}});  // crosses itself: no crash, right count
  EXPECT_LE(bow.triangles.size(), 3U);
}

}  // namespace
