// read_mesh_file: strips, bad faces, given normals, what is left out, and files of other kinds.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <bit>
#include <cmath>

#include "core/error.hpp"
#include "io/mesh_file.hpp"
#include "scratch.hpp"

namespace parian {
namespace {

using Faces = std::vector<std::vector<std::uint32_t>>;

const std::string ply_xyz = "property float x\nproperty float y\nproperty float z\n";
const std::string four_points = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
const std::string four_v = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
const std::string ply_faces = "property list uchar int vertex_indices\nend_header\n";

class MeshContents : public testing::Test {
 protected:
  PolygonMesh read(const std::string& name, const std::string& bytes) {
    return read_mesh_file(scratch_.write(name, bytes));
  }
  std::string refusal(const std::string& name, const std::string& bytes) {
    const auto path = scratch_.write(name, bytes);
    try {
      (void)read_mesh_file(path);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input);
      const std::string message = error.what();
      EXPECT_TRUE(message.starts_with(path.string())) << message;
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      return message.substr(scratch_.folder().string().size() + 1);
    }
    return "no error";
  }
  /// The one warning that reading ends with.
  std::string warning(const std::string& name, const std::string& bytes) {
    const PolygonMesh mesh = read(name, bytes);
    EXPECT_EQ(mesh.warnings.size(), 1U) << name;
    return mesh.warnings.empty() ? "no warning" : mesh.warnings.front();
  }

  test::Scratch scratch_;
};

Faces faces_of(const PolygonMesh& mesh) {
  Faces faces;
  std::size_t at = 0;
  for (const std::uint32_t size : mesh.face_sizes) {
    faces.emplace_back(mesh.corners.begin() + at, mesh.corners.begin() + at + size);
    at += size;
  }
  return faces;
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::string ply(const std::string& vertex, const std::string& rest) {
  return "ply\nformat ascii 1.0\nelement vertex 4\n" + ply_xyz + vertex + rest;
}

TEST_F(MeshContents, StripsOfTrianglesAreRead) {
  const std::string head = "element tristrips 2\nproperty list int int vertex_indices\nend_header\n" + four_points;
  // Every other triangle is turned; a restart begins with an even one; what names a point twice only leads on.
  const PolygonMesh mesh = read("a.ply", ply("", head + "9 0 1 2 3 0 1 -1 0 2\n8 -1 3 2 1 1 0 2 -1\n"));
  EXPECT_EQ(faces_of(mesh), (Faces{{0, 1, 2}, {2, 1, 3}, {2, 3, 0}, {0, 3, 1}, {3, 2, 1}, {0, 1, 2}}));
  ASSERT_EQ(mesh.warnings.size(), 1U);  // the strip 0 2 has no triangle
  EXPECT_TRUE(has(mesh.warnings[0], "a face of fewer than three corners is left out, the first in line 14"))
      << mesh.warnings[0];
  const PolygonMesh both =
      read("b.ply", "ply\nformat ascii 1.0\nelement face 1\n" + ply_faces.substr(0, ply_faces.find("end")) +
                        "element tristrips 1\nproperty list int int vertex_index\nelement vertex 4\n" + ply_xyz +
                        "end_header\n3 0 2 1\n4 0 1 2 3\n" + four_points);
  EXPECT_EQ(faces_of(both), (Faces{{0, 2, 1}, {0, 1, 2}, {2, 1, 3}}));
  for (const bool big : {false, true}) {
    std::string bytes = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                        "_endian 1.0\nelement vertex 4\n" + ply_xyz +
                        "element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
    const auto append = [&](std::uint32_t word) {
      for (int i = 0; i < 4; ++i) bytes += static_cast<char>(word >> 8 * (big ? 3 - i : i));
    };
    for (const float x : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F})
      append(std::bit_cast<std::uint32_t>(x));
    for (const int word : {8, 0, 1, 2, 3, -1, 1, 2, 3}) append(static_cast<std::uint32_t>(word));
    EXPECT_EQ(faces_of(read("c.ply", bytes)), (Faces{{0, 1, 2}, {2, 1, 3}, {1, 2, 3}}));
  }
  EXPECT_TRUE(has(refusal("d.ply", ply("", head + "3 0 1 4\n3 0 1 2\n")), "d.ply:14: a face names point 4"));
  EXPECT_TRUE(has(refusal("d.ply", ply("", head + "3 0 1 -2\n3 0 1 2\n")), "names point -2"));
}

TEST_F(MeshContents, PointsWithoutASurfaceAreCalledWhatTheyAre) {
  const std::string end = "end_header\n0 0 0 1\n1 0 0 1\n0 1 0 1\n0 0 1 1\n";
  EXPECT_TRUE(has(refusal("s.ply", ply("property float f_dc_0\n", end)), "Gaussian splat"));
  EXPECT_TRUE(
      has(refusal("s.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty uint packed_position\nend_header\n1"),
          "Gaussian splat"));
  const std::string cloud = refusal("p.ply", ply("property float intensity\n", end));
  EXPECT_TRUE(has(cloud, "point cloud") && !has(cloud, "splat")) << cloud;
}

TEST_F(MeshContents, BadFacesAreLeftOutAndCounted) {
  const std::string two = "f 1 3 2\nf 1 2 4\n";
  const std::string obj = warning("a.obj", four_v + two + "f 1 2\nf 2 3 4\nf 3\nf 1 4 3\n");
  EXPECT_TRUE(has(obj, "2 faces of fewer than three corners are left out, the first in line 7")) << obj;
  EXPECT_EQ(faces_of(read("a.obj", four_v + "f 4\n" + two)), (Faces{{0, 2, 1}, {0, 1, 3}}));
  const std::string faces = "3 0 2 1\n2 0 1\n3 0 1 3\n0\n";
  const Faces kept{{0, 2, 1}, {0, 1, 3}};
  for (const auto& [name, bytes, line] :
       {std::tuple{"a.ply", ply("", fmt::format("element face 4\n{}{}{}", ply_faces, four_points, faces)), "line 15"},
        std::tuple{"a.off", fmt::format("OFF\n4 4 0\n{}{}", four_points, faces), "line 8"}}) {
    const std::string said = warning(name, bytes);
    EXPECT_TRUE(has(said, "2 faces") && has(said, line)) << said;
    EXPECT_EQ(faces_of(read(name, bytes)), kept) << name;
  }
  const std::string stl =
      warning("a.stl",
              "solid\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nouter loop\nvertex 0 0 0\n"
              "vertex 1 0 0\nendloop\nendsolid\n");
  EXPECT_TRUE(has(stl, "line 10")) << stl;
  EXPECT_TRUE(
      has(refusal("b.stl", "solid\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nvertex 1 1 0\nendloop\n"),
          "b.stl:7: a facet doesn't have 3 vertices"));
  // A broken index or number is an error, in a bad face too.
  EXPECT_TRUE(has(refusal("a.obj", four_v + two + "f 1 5\n"), "a.obj:7: a face names point 5"));
  EXPECT_TRUE(has(refusal("a.obj", four_v + two + "f 1 x\n"), "a.obj:7: 'x' is not a corner"));
  EXPECT_TRUE(
      has(refusal("a.off", "OFF\n4 2 0\n" + four_points + "3 0 2 1\n2 0 4\n"), "a.off:8: a face names point '4'"));
  EXPECT_TRUE(has(refusal("a.ply", ply("", "element face 2\n" + ply_faces + four_points + "3 0 2 1\n2 0 1.5\n")),
                  "a.ply:15: a face names point 1.5"));
  EXPECT_TRUE(has(refusal("n.obj", four_v + "f 1 2\n"), "none of the faces has three corners"));
}

TEST_F(MeshContents, SaysWhatItLeavesOutInOneLine) {
  const std::string faces = "element face 1\n" + ply_faces;
  const std::string colours =
      warning("a.ply", ply("property uchar red\n", faces + "0 0 0 9\n1 0 0 9\n0 1 0 9\n0 0 1 9\n3 0 1 2\n"));
  EXPECT_TRUE(has(colours, "left out (vertex colours)")) << colours;
  const std::string obj = warning(
      "a.obj", "mtllib a.mtl\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\nl 1 2\n");
  EXPECT_TRUE(has(obj, "(vertex colours, texture coordinates, materials, lines, points and curves)")) << obj;
  EXPECT_TRUE(read("w.obj", "v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 1 2 3\n").warnings.empty());  // a weight is no colour
  EXPECT_TRUE(has(warning("a.off", "COFF\n3 1 0\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n0 1 0 1 0 0 1\n3 0 1 2 0.5\n"),
                  "(vertex colours, face colours)"));
  std::string stl(84, '\0');
  stl.replace(0, 10, "COLOR=RGBA");
  stl[80] = 1;
  for (const float x : {0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F})
    for (int i = 0; i < 4; ++i) stl += static_cast<char>(std::bit_cast<std::uint32_t>(x) >> 8 * i);
  EXPECT_TRUE(has(warning("a.stl", stl + std::string(2, '\0')), "(face colours)"));
  stl.replace(0, 10, "plain file");
  EXPECT_TRUE(read("b.stl", stl + std::string(2, '\0')).warnings.empty());
  EXPECT_TRUE(has(warning("c.stl", stl + std::string("\0\x80", 2)), "(face colours)"));
  EXPECT_TRUE(read("plain.obj", four_v + "s off\no name\ng group\nf 1 2 3\n").warnings.empty());
}

/// The normal that each corner of the file was given.
std::vector<glm::vec3> corner_normals(const PolygonMesh& mesh) {
  std::vector<glm::vec3> normals;
  for (std::size_t i = 0; i < mesh.corners.size() && !mesh.normals.empty(); ++i) {
    const std::uint32_t id = mesh.corner_normals.empty() ? mesh.corners[i] : mesh.corner_normals[i];
    normals.push_back(id == no_normal ? glm::vec3(0) : mesh.normals[id]);
  }
  return normals;
}

TEST_F(MeshContents, GivenNormalsComeAlong) {
  const glm::vec3 x(1, 0, 0), y(0, 1, 0), z(0, 0, 1), none(0);
  const PolygonMesh obj =
      read("a.obj", four_v + "vn 1 0 0\nvn 0 1 0\nf 1//1 2//2 3/7/-1 4\nf 1/2/2 3 4\nvn 0 0 1\nf 3//3 2//-1 1//1\n");
  EXPECT_EQ(corner_normals(obj), (std::vector<glm::vec3>{x, y, y, none, y, none, none, z, z, x}));
  EXPECT_EQ(corner_normals(read("b.obj", four_v + "vn 1 0 0\nvn 0 1 0\nvn 0 0 1\nvn 1 0 0\nf 4 3 2\n")),
            (std::vector<glm::vec3>{x, z, y}));  // one for each point
  EXPECT_TRUE(has(warning("c.obj", four_v + "vn 1 0 0\nf 1 2 3\n"), "(some normals)"));
  EXPECT_TRUE(has(refusal("d.obj", four_v + "vn 1 0 0\nf 1//1 2//2 3//1\n"), "d.obj:6: a face names normal 2"));
  EXPECT_TRUE(has(refusal("d.obj", four_v + "f 1//-1 2 3\n"), "before the first normal"));
  EXPECT_TRUE(has(refusal("d.obj", four_v + "vn 1 0\nf 1 2 3\n"), "d.obj:5: '' is not a number"));
  const std::string n = "property float nx\nproperty float ny\nproperty float nz\n";
  const std::string faces = "element face 1\n" + ply_faces;
  const std::string body = "0 0 0 1 0 0\n1 0 0 0 1 0\n0 1 0 0 0 1\n0 0 1 1 0 0\n3 1 2 0\n";
  EXPECT_EQ(corner_normals(read("a.ply", ply(n, faces + body))), (std::vector<glm::vec3>{y, z, x}));
  EXPECT_TRUE(has(warning("b.ply", ply("property float nx\n", faces + "0 0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 1\n3 1 2 0\n")),
                  "(some normals)"));
  EXPECT_EQ(corner_normals(read("a.off", "NOFF\n4 1 0\n" + body)), (std::vector<glm::vec3>{y, z, x}));
  EXPECT_EQ(corner_normals(read(
                "b.off", "CNOFF\n3 1 0\n0 0 0 1 0 0 9 9 9 9\n1 0 0 0 1 0 9 9 9 9\n0 1 0 0 0 1 9 9 9 9\n3 1 2 0\n")),
            (std::vector<glm::vec3>{y, z, x}));
}

TEST_F(MeshContents, GivenNormalsOfOpenMeshComeAlong) {
  OpenMesh::PolyMesh_ArrayKernelT<> mesh;
  const auto a = mesh.add_vertex({0, 0, 0}), b = mesh.add_vertex({1, 0, 0}), c = mesh.add_vertex({0, 1, 0});
  mesh.add_face(a, b, c);
  mesh.request_vertex_normals();
  mesh.set_normal(a, {1, 0, 0});
  mesh.set_normal(b, {0, 1, 0});
  mesh.set_normal(c, {0, 0, 1});
  const auto path = scratch_ / "a.om";
  ASSERT_TRUE(OpenMesh::IO::write_mesh(mesh, path.string(), OpenMesh::IO::Options::VertexNormal));
  EXPECT_EQ(read_mesh_file(path).normals, (std::vector<glm::vec3>{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}));
}

TEST_F(MeshContents, OtherKindsOfFilesAreNamedWithAWayOut) {
  std::string zip = std::string("PK\x03\x04") + std::string(22, '\0') + std::string("\x10\0\0\0", 4);
  const std::vector<std::array<std::string, 4>> files{
      {"a.glb", std::string("glTF\2\0\0\0", 8), "glTF", "export"},
      {"a.gltf", "{\n \"asset\": {\"version\": \"2.0\"}}", "glTF", "export"},
      {"a.fbx", std::string("Kaydara FBX Binary  \0", 21), "FBX", "export"},
      {"b.fbx", "; FBX 7.4.0 project file\n", "FBX", "export"},
      {"a.usda", "#usda 1.0\n", "USD", "export"},
      {"a.usdc", "PXR-USDC", "USD", "export"},
      {"a.usdz", zip + "geometry.v1.usdc and more", "USD", "export"},
      {"a.3mf", zip + "3D/3dmodel.model and more", "3MF", "export"},
      {"a.zip", zip + "some-other-name0 and more", "ZIP", "unzip"},
      {"a.gz", std::string("\x1f\x8b\x08\0", 4), "gzip", "gunzip"},
      {"a.lfs", "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n", "Git LFS pointer",
       "git lfs pull"},
      {"a.dae", "<?xml version=\"1.0\"?>\n<COLLADA>", "COLLADA", "export"},
      {"a.html", "<!DOCTYPE html>\n<html>", "web page", "download"},
  };
  for (const auto& [name, bytes, kind, way_out] : files)
    for (const std::string& as :
         {name, std::string("x.ply"), std::string("x.obj"), std::string("x.stl"), std::string("x")}) {
      const std::string said = refusal(as, bytes);
      EXPECT_TRUE(has(said, kind) && has(said, way_out)) << as << ' ' << said;
    }
  EXPECT_TRUE(has(refusal("a.fbx", "who knows"), "FBX"));  // by its name
  EXPECT_TRUE(has(refusal("a.3mf", zip + "[Content_Types]."), "3MF"));
}

}  // namespace
}  // namespace parian
