// read_mesh_file: every format's habits, and every kind of damage, on files that the test writes.
#include "io/mesh_file.hpp"

#include <gtest/gtest.h>

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <algorithm>
#include <bit>
#include <fstream>
#include <random>

#include "core/error.hpp"

namespace {

using parian::PolygonMesh;

/// A folder of its own for each test, removed at its end.
class MeshFile : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    std::random_device device;
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("parian-") + test->name() + "-" + std::to_string(device()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::filesystem::remove(folder_ / name);  // to overwrite makes some file systems wait for the disk
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  PolygonMesh read(const std::string& name, const std::string& bytes) const {
    return parian::read_mesh_file(write(name, bytes));
  }
  /// The message of the error that reading must end with, without the folder.
  std::string error(const std::string& name, const std::string& bytes) const { return error_of(write(name, bytes)); }
  std::string error_of(const std::filesystem::path& path) const {
    try {
      (void)parian::read_mesh_file(path);
    } catch (const parian::Error& e) {
      EXPECT_EQ(e.kind(), parian::ErrorKind::input);
      const std::string message = e.what();
      EXPECT_TRUE(message.starts_with(path.string() + ":")) << message;
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      return message.substr(folder_.string().size() + 1);
    }
    return "no error";
  }
  std::filesystem::path folder_;
};

void append_number(std::string& bytes, auto value, bool big) {
  auto raw = std::bit_cast<std::array<char, sizeof value>>(value);
  if (big != (std::endian::native == std::endian::big)) std::reverse(raw.begin(), raw.end());
  bytes.append(raw.data(), raw.size());
}

/// A unit square of one quad and a triangle on its side: 5 points, 2 faces.
const std::vector<glm::dvec3> points{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0.5, 0}};
const std::vector<std::uint32_t> sizes{4, 3};
const std::vector<std::uint32_t> corners{0, 1, 2, 3, 1, 4, 2};

void expect_sample(const PolygonMesh& mesh) {
  EXPECT_EQ(mesh.points, points);
  EXPECT_EQ(mesh.face_sizes, sizes);
  EXPECT_EQ(mesh.corners, corners);
}

const std::string ascii_points = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0.5 0\n";
const std::string ascii_faces = "4 0 1 2 3\n3 1 4 2\n";
const std::string ply_xyz = "property float x\nproperty float y\nproperty float z\n";
const std::string ply_start = "ply\nformat ascii 1.0\ncomment element vertex 9\n";

std::string binary_ply(bool big, bool rich) {
  std::string bytes = std::string("ply\r\nformat binary_") + (big ? "big" : "little") + "_endian 1.0\r\n" +
                      "element vertex 5\r\nproperty double x\r\nproperty float confidence\r\nproperty double y\r\n" +
                      "property double z\r\nproperty uchar red\r\n" +
                      (rich ? "property list uchar short rings\r\n" : "") + "element face 2\r\n" +
                      (rich ? "property ushort flags\r\n" : "") + "property list uint ushort vertex_index\r\n" +
                      (rich ? "property list uint8 float texcoord\r\n" : "") + "end_header\r\n";
  for (const glm::dvec3& p : points) {
    append_number(bytes, p.x, big);
    append_number(bytes, 0.5F, big);
    append_number(bytes, p.y, big);
    append_number(bytes, p.z, big);
    bytes += '\x0a';
    if (!rich) continue;
    bytes += '\x02';
    append_number(bytes, std::int16_t{7}, big);
    append_number(bytes, std::int16_t{-7}, big);
  }
  std::size_t at = 0;
  for (const std::uint32_t size : sizes) {
    if (rich) append_number(bytes, std::uint16_t{9}, big);
    append_number(bytes, size, big);
    for (std::uint32_t i = 0; i < size; ++i) append_number(bytes, static_cast<std::uint16_t>(corners[at++]), big);
    if (!rich) continue;
    bytes += '\x01';
    append_number(bytes, 0.25F, big);
  }
  return bytes;
}

std::string binary_stl(std::uint32_t promised, const std::vector<float>& coordinates, const std::string& header) {
  std::string bytes = header;
  bytes.resize(80, ' ');
  append_number(bytes, promised, false);
  for (std::size_t i = 0; i < coordinates.size(); i += 9) {
    bytes.append(12, '\0');
    for (std::size_t k = i; k < i + 9; ++k) append_number(bytes, coordinates[k], false);
    bytes.append(2, '\0');
  }
  return bytes;
}

const std::vector<float> two_triangles{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0};

std::string binary_off(bool geomview) {
  std::string bytes = "OFF BINARY\n";
  for (const std::uint32_t count : {5U, 2U, 0U}) append_number(bytes, count, geomview);
  for (const glm::dvec3& p : points)
    for (int axis = 0; axis < 3; ++axis) append_number(bytes, static_cast<float>(p[axis]), geomview);
  std::size_t at = 0;
  for (const std::uint32_t size : sizes) {
    append_number(bytes, size, geomview);
    for (std::uint32_t i = 0; i < size; ++i) append_number(bytes, corners[at++], geomview);
    if (!geomview) continue;
    append_number(bytes, std::uint32_t{1}, geomview);  // one colour
    append_number(bytes, 0.5F, geomview);
  }
  return bytes;
}

template <class Traits>
std::string om_file(const std::filesystem::path& path) {
  OpenMesh::PolyMesh_ArrayKernelT<Traits> mesh;
  using Point = typename decltype(mesh)::Point;
  std::vector<OpenMesh::VertexHandle> handles;
  for (const glm::dvec3& p : points)
    handles.push_back(mesh.add_vertex(
        Point(static_cast<typename Point::value_type>(p.x), static_cast<typename Point::value_type>(p.y), 0)));
  mesh.add_face(handles[0], handles[1], handles[2], handles[3]);
  mesh.add_face(handles[1], handles[4], handles[2]);
  mesh.request_vertex_normals();
  mesh.request_face_normals();
  mesh.update_normals();
  OpenMesh::VPropHandleT<double> weight;
  mesh.add_property(weight, "weight");
  mesh.property(weight).set_persistent(true);
  EXPECT_TRUE(OpenMesh::IO::write_mesh(mesh, path.string(),
                                       OpenMesh::IO::Options::VertexNormal | OpenMesh::IO::Options::FaceNormal));
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Polygons equal up to where each begins.
void expect_same_faces(const PolygonMesh& mesh) {
  ASSERT_EQ(mesh.points, points);
  ASSERT_EQ(mesh.face_sizes, sizes);
  std::size_t begin = 0;
  for (const std::uint32_t size : sizes) {
    std::vector<std::uint32_t> face(mesh.corners.begin() + begin, mesh.corners.begin() + begin + size);
    const auto first = std::find(face.begin(), face.end(), corners[begin]);
    ASSERT_NE(first, face.end());
    std::rotate(face.begin(), first, face.end());
    EXPECT_TRUE(std::equal(face.begin(), face.end(), corners.begin() + begin));
    begin += size;
  }
}

TEST_F(MeshFile, PlyAscii) {
  const std::string vertices = "element vertex 5\n" + ply_xyz;
  const std::string faces = "element face 2\nproperty list uchar int vertex_indices\n";
  expect_sample(read("a.PLY", ply_start + vertices + faces + "end_header\n" + ascii_points + ascii_faces));
  expect_sample(read("first.ply", ply_start + faces + vertices + "end_header\n" + ascii_faces + ascii_points));
  const std::string extra = "element edge 1\nproperty int a\nproperty list uchar int b\n";
  expect_sample(read("edge.ply", ply_start + extra + vertices + faces + "end_header\n7 2 8 9\n" + ascii_points +
                                     "4 0 1 2 3 3 1\n4 2"));
}

TEST_F(MeshFile, PlyKeepsDoubles) {
  std::string text = ply_start + "element vertex 3\n" + ply_xyz + "element face 1\nproperty list int int " +
                     "vertex_indices\nend_header\n1000000.123456789 0 0\n+1 0 0\n0 1e-300 1e-1\n3 0 1 2\n";
  const PolygonMesh mesh = read("d.ply", text);
  EXPECT_EQ(mesh.points[0].x, 1000000.123456789);
  EXPECT_EQ(mesh.points[2].y, 1e-300);
}

TEST_F(MeshFile, PlyBinary) {
  for (const bool big : {false, true})
    for (const bool rich : {false, true}) expect_sample(read("b.ply", binary_ply(big, rich)));
}

TEST_F(MeshFile, PlyBad) {
  const auto file = [&](const std::string& count, const std::string& rest) {
    return ply_start + "element vertex " + count + "\n" + ply_xyz +
           "element face 1\nproperty list uchar int vertex_indices\nend_header\n" + rest;
  };
  EXPECT_NE(error("a.ply", file("4000000000", "0 0 0\n")).find("truncated"), std::string::npos);
  EXPECT_NE(error("a.ply", file("99999999999", "")).find("a.ply:4: '99999999999' is not"), std::string::npos);
  EXPECT_NE(error("a.ply", file("3", "0 0 0\n1 0 0\n0 1 0\n3 0 1")).find("a.ply:14: the file ends"), std::string::npos);
  EXPECT_NE(error("a.ply", file("3", "0 0 0\n1 0 nan\n0 1 0\n3 0 1 2")).find("a.ply:12: coordinate nan is not finite"),
            std::string::npos);
  EXPECT_NE(error("a.ply", file("3", "0 0 0\n1 0 1e39\n0 1 0\n3 0 1 2")).find("too large"), std::string::npos);
  EXPECT_NE(error("a.ply", file("3", "0 0 0\n1 x 0\n0 1 0\n3 0 1 2")).find(":12: 'x' is not a number"),
            std::string::npos);
  EXPECT_NE(error("a.ply", file("3", "0 0 0\n1 0 0\n0 1 0\n3 0 1 3")).find(":14: a face names point 3, but points"),
            std::string::npos);
  EXPECT_NE(error("a.ply", file("3", "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1")).find("names point -1"), std::string::npos);
  EXPECT_NE(error("a.ply", file("3", "0 0 0\n1 0 0\n0 1 0\n2 0 1")).find("three corners"), std::string::npos);
  EXPECT_NE(error("a.ply", file("3", "0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2")).find("can't fit"), std::string::npos);
  EXPECT_NE(error("a.ply", file("3", "0 0 0\n1 0 0\n0 1 0\n9 0 1 2\n")).find(":14: a list of 9 values can't fit"),
            std::string::npos);
  EXPECT_NE(error("a.ply", ply_start + "element vertex 1\n" + ply_xyz + "end_header\n0 0 0\n").find("no faces"),
            std::string::npos);
  EXPECT_NE(error("a.ply", ply_start + "element vertex 1\n").find("ends within the PLY header"), std::string::npos);
  EXPECT_NE(error("a.ply", "plx\n").find("a.ply:1: this isn't a PLY file"), std::string::npos);
  EXPECT_NE(error("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty real x\n").find(":4: unknown PLY type"),
            std::string::npos);
  std::string bytes = binary_ply(true, true);
  bytes.pop_back();
  EXPECT_NE(error("b.ply", bytes).find("truncated"), std::string::npos);
}

TEST_F(MeshFile, Obj) {
  const std::string text =
      "# comment\r\nmtllib none.mtl\r\no thing\nv 0 0 0 1 0.5 0.5\nv 1 0 0\nv 1 1 0\nv 0 1 0 # here\nvt 0 0\nvt 1 1\n"
      "vn 0 0 1\nf 1/1/1 2/2/1 3//1 4\nv 2 \\\n 0.5 0\nusemtl m\ns off\nf -4/-1 -1 -3\n";
  expect_sample(read("a.obj", text));
  const PolygonMesh pinched = read("p.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv -1 0 0\nv -1 1 0\nf 1 2 3 1 5 4\nf 1 1 1\n");
  EXPECT_EQ(pinched.points.size(), 5U);
  EXPECT_EQ(pinched.corners, (std::vector<std::uint32_t>{0, 1, 2, 0, 4, 3, 0, 0, 0}));
}

TEST_F(MeshFile, ObjBad) {
  const std::string three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  EXPECT_NE(error("a.obj", three + "f 1 2 4\n").find("a.obj:4: a face names point 4"), std::string::npos);
  EXPECT_NE(error("a.obj", three + "f 1 2 0\n").find("a.obj:4: '0' is not a corner"), std::string::npos);
  EXPECT_NE(error("a.obj", three + "f 1 2 -4\n").find("a.obj:4: '-4' reaches back"), std::string::npos);
  EXPECT_NE(error("a.obj", three + "f 1 2 x\n").find("'x' is not a corner"), std::string::npos);
  EXPECT_NE(error("a.obj", three + "f 1 2 99999999999999999999\n").find("is not a corner"), std::string::npos);
  EXPECT_NE(error("a.obj", three + "f 1 2\n").find("three corners"), std::string::npos);
  EXPECT_NE(error("a.obj", "v 0 0\n" + three + "f 1 2 3\n").find("a.obj:1: a point has fewer"), std::string::npos);
  EXPECT_NE(error("a.obj", "v 0 \\\n inf 0\n" + three + "f 1 2 3\n").find("'inf' is not finite"), std::string::npos);
  EXPECT_NE(error("a.obj", three).find("no faces"), std::string::npos);
  // Lines that a backslash joins, in comments too, count as they stand in the file; the first of them is named.
  EXPECT_NE(error("a.obj", "# a \\\nv x\nv 0 0 \\\r\n0\nv 1 0 0\nv 0 \\\nz 1\nf 1 2 3\n").find("a.obj:6: 'z' is not"),
            std::string::npos);
}

TEST_F(MeshFile, Off) {
  const std::string counts = "5 2 0\n";
  expect_sample(read("a.off", "OFF\n" + counts + ascii_points + ascii_faces));
  expect_sample(
      read("c.off", "# before\n\nOFF # here\n# there\n 5 2\n\n" + ascii_points + "# between\n" + ascii_faces));
  expect_sample(read("one.off", "OFF " + counts + ascii_points + "4 0 1\n2 3 255 0 0\n3 1 4 2 0.5 0.5 0.5 1"));
  const std::string coloured =
      counts + "0 0 0 9 9 9\n1 0 0 9 9 9\n1 1 0 9 9 9\n0 1 0 9 9 9\n2 0.5 0 9 9 9\n" + ascii_faces;
  for (const std::string keyword : {"COFF\n", "NOFF\n", "STOFF\n", "\nNOFF\n", "OFF\n"})
    expect_sample(read("k.off", keyword + coloured));
  for (const bool geomview : {false, true}) expect_sample(read("b.off", binary_off(geomview)));
  expect_sample(read("a.off", "OFF\n" + counts + ascii_points + ascii_faces));  // after a binary one
}

TEST_F(MeshFile, OffBad) {
  EXPECT_NE(error("a.off", "OFF\n4000000000 1 0\n").find("a.off:2: '4000000000' is not"), std::string::npos);
  EXPECT_NE(error("a.off", "OFF\n2000000000 1 0\n0 0 0\n").find("promises 2000000000 points"), std::string::npos);
  EXPECT_NE(error("a.off", "OFF\n3 2 0\n0 0 0.0\n1 0 0.0\n0 1 0.0\n3 0 1 2\n").find(":7: the file ends"),
            std::string::npos);
  EXPECT_NE(error("a.off", "OFF\n3 1 0\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n\n\n").find(":4: a point has fewer"),
            std::string::npos);
  EXPECT_NE(error("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 NAN\n3 0 1 2\n").find(":5: coordinate 'NAN' is not finite"),
            std::string::npos);
  EXPECT_NE(error("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n").find(":6: a face names point '3'"),
            std::string::npos);
  EXPECT_NE(error("a.off", "OFF\n0 0 0\n").find("no faces"), std::string::npos);
  EXPECT_NE(error("a.off", "4OFF\n1 1 0\n").find("three-dimensional"), std::string::npos);
  EXPECT_NE(error("a.off", "FOO\n").find("isn't an OFF file"), std::string::npos);
  EXPECT_NE(error("a.off", binary_off(true).substr(0, 110)).find("truncated"), std::string::npos);
}

TEST_F(MeshFile, Stl) {
  const std::string facet =
      " facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n\n   VERTEX 1 1 0\n  " +
      std::string("endloop\n endfacet\n");
  const std::string ascii = "solid vertex of\n" + facet + "facet normal 0 0 1 outer loop vertex 0 0 0\nvertex 1 1 0\n" +
                            "vertex 0 1 0 endloop endfacet\nendsolid\nsolid two\nendsolid two\n";
  for (const std::string& bytes : {ascii, binary_stl(2, two_triangles, "plain"), binary_stl(2, two_triangles, "solid "),
                                   binary_stl(2, two_triangles, "solid x") + "trailing"}) {
    const PolygonMesh mesh = read("a.stl", bytes);
    EXPECT_EQ(mesh.points, (std::vector<glm::dvec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
    EXPECT_EQ(mesh.corners, (std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3}));
  }
  const std::vector<float> near{0, 0, 0, 1, 0, 0, 1, 1, 0, 1e-40F, 0, 0, 1, 1, 0, 0, 1, 0};
  EXPECT_EQ(read("near.stl", binary_stl(2, near, "")).points.size(), 5U);  // joined only when equal
  std::string fine = ascii;
  fine.replace(fine.find("1 1 0"), 5, "16777217.0000000001 1 0");  // a double would end half-way between two floats
  EXPECT_EQ(read("fine.stl", fine).points[2].x, 16777218.0);
}

TEST_F(MeshFile, StlBad) {
  EXPECT_NE(error("a.stl", binary_stl(4000000000U, two_triangles, "")).find("promises 4000000000"), std::string::npos);
  EXPECT_NE(error("a.stl", binary_stl(2, two_triangles, "").substr(0, 183)).find("truncated"), std::string::npos);
  std::vector<float> bad = two_triangles;
  bad[10] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(error("a.stl", binary_stl(2, bad, "")).find("triangle 1: a coordinate is not finite"), std::string::npos);
  EXPECT_NE(error("a.stl", binary_stl(0, {}, "")).find("no triangles"), std::string::npos);
  EXPECT_NE(error("a.stl", "hello").find("neither an ASCII nor a binary"), std::string::npos);
  EXPECT_NE(error("a.stl", "solid\nfacet\nouter loop\nvertex 0 0 0\n").find("a.stl:5: the file ends within"),
            std::string::npos);
  EXPECT_NE(error("a.stl", "solid\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nendloop\n").find("no triangles"),
            std::string::npos);
  EXPECT_NE(error("a.stl", "solid\nouter loop\nvertex 0 0 1,5\n").find("a.stl:3: '1,5' is not a number"),
            std::string::npos);
  EXPECT_NE(error("a.stl", "solid\nendsolid\n").find("no triangles"), std::string::npos);
}

struct DoubleTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};

TEST_F(MeshFile, Om) {
  const std::string single = om_file<OpenMesh::DefaultTraits>(folder_ / "s.om");
  expect_same_faces(parian::read_mesh_file(folder_ / "s.om"));
  (void)om_file<DoubleTraits>(folder_ / "d.om");
  expect_same_faces(parian::read_mesh_file(folder_ / "d.om"));
  EXPECT_NE(error("t.om", single.substr(0, 60)).find("truncated"), std::string::npos);
  std::string huge = single;
  huge[7] = '\x7f';  // points
  EXPECT_NE(error("h.om", huge).find("can't fit"), std::string::npos);
  EXPECT_NE(error("x.om", "OMX................").find("isn't an OpenMesh file"), std::string::npos);
}

TEST_F(MeshFile, Paths) {
  EXPECT_NE(error_of(folder_ / "none.ply").find("no such file"), std::string::npos);
  EXPECT_NE(error("mesh.xyz", "x").find("unknown mesh format '.xyz'"), std::string::npos);
  EXPECT_NE(error("mesh", "x").find("unknown mesh format"), std::string::npos);
  std::filesystem::create_directories(folder_ / "folder.ply");
  EXPECT_NE(error_of(folder_ / "folder.ply").find("this is a directory"), std::string::npos);
  for (const char* name : {"e.ply", "e.obj", "e.off", "e.stl", "e.om"})
    EXPECT_NE(error(name, "").find("the file is empty"), std::string::npos);
}

/// Whatever is cut off or flipped, the result is a mesh or an Error.
TEST_F(MeshFile, DamageNeverCrashes) {
  const std::vector<std::pair<std::string, std::string>> files{
      {"a.ply", ply_start + "element vertex 5\n" + ply_xyz +
                    "element face 2\nproperty list uchar int vertex_indices\n" + "end_header\n" + ascii_points +
                    ascii_faces},
      {"b.ply", binary_ply(true, true)},
      {"c.off", "OFF\n5 2 0\n" + ascii_points + ascii_faces},
      {"d.off", binary_off(true)},
      {"e.stl", binary_stl(2, two_triangles, "solid")},
      {"f.om", om_file<OpenMesh::DefaultTraits>(folder_ / "f.om")},
      {"g.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nvn 0 0 1\nf 1//1 2//-1 -1//1\nf 1 2\n"},
      {"h.ply", ply_start + "element vertex 5\n" + ply_xyz +
                    "element tristrips 1\nproperty list int int vertex_indices\nend_header\n" + ascii_points +
                    "8 0 1 2 3 -1 1 4 2\n"}};
  std::mt19937 random(1);
  for (const auto& [name, bytes] : files) {
    for (std::size_t length = 0; length < bytes.size(); ++length) try {
        (void)read(name, bytes.substr(0, length));
      } catch (const parian::Error&) {
      }
    for (int i = 0; i < 200; ++i) {
      std::string flipped = bytes;
      for (int k = 0; k < 3; ++k) flipped[random() % flipped.size()] ^= static_cast<char>(1U << random() % 8);
      try {
        const PolygonMesh mesh = read(name, flipped);
        for (const std::uint32_t corner : mesh.corners) ASSERT_LT(corner, mesh.points.size());
      } catch (const parian::Error&) {
      }
    }
  }
}

}  // namespace
