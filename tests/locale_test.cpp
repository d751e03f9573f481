// Files are read and written alike by programs whose locale has a decimal comma.
#include "comma_locale.hpp"

#include <cmath>

#include "io/mesh_file.hpp"
#include "io/render_options.hpp"
#include "io/scene_file.hpp"
#include "truth/vectors.hpp"

namespace parian {
namespace {

class FilesInLocale : public test::InCommaLocale {
 protected:
  test::Scratch scratch_;
};

TEST_P(FilesInLocale, NumbersStay) {
  const test::CommaLocale locale(GetParam());
  if (!locale.there()) GTEST_SKIP() << "no German locale could be made";
  const std::string corners = "0.25 0 0\n1.5 0 -2.75e-1\n0 1234.5 0\n", face = "3 0 1 2\n";
  const std::pair<const char*, std::string> meshes[] = {
      {"a.off", "OFF\n3 1 0\n" + corners + face},
      {"a.obj", "v 0.25 0 0\nv 1.5 0 -2.75e-1\nv 0 1234.5 0\nf 1 2 3\n"},
      {"a.ply",
       "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
       "element face 1\nproperty list uchar int vertex_indices\nend_header\n" +
           corners + face},
      {"a.stl",
       "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0.25 0 0\nvertex 1.5 0 -2.75e-1\nvertex 0 1234.5 0\n"
       "endloop\nendfacet\nendsolid a\n"},
  };
  for (const auto& [name, text] : meshes) {
    const PolygonMesh mesh = read_mesh_file(scratch_.write(name, text));
    ASSERT_EQ(mesh.points.size(), 3U) << name;
    EXPECT_EQ(mesh.points[0].x, 0.25) << name;
    EXPECT_EQ(mesh.points[1].x, 1.5) << name;
    EXPECT_NEAR(mesh.points[1].z, -0.275, 1e-7) << name;  // STL has floats
    EXPECT_EQ(mesh.points[2].y, 1234.5) << name;
  }
  scratch_.write("tet.obj", test::tetrahedron);
  const Input input = load_input(scratch_.write("a.toml",
                                                "unit = 0.5\n[[object]]\nmesh = \"tet.obj\"\nmaterial = \"a\"\n"
                                                "[material.a]\nsigma_s = [1.25, 2.5, 1234.5]\nsigma_a = [0.5, 0.5, "
                                                "0.5]\nior = 1.33\n[render]\nerror = 2.5e-3\n"),
                                 {});
  EXPECT_EQ(input.scene.material.sigma_s, glm::dvec3(1.25, 2.5, 1234.5));
  EXPECT_EQ(input.scene.material.ior, 1.33);
  EXPECT_EQ(input.settings.error, 2.5e-3);
  EXPECT_NE(describe(input.settings).find("error=0.0025"), std::string::npos) << describe(input.settings);
  EXPECT_EQ(parse_number("1234.5"), 1234.5);
  EXPECT_FALSE(parse_number("1,5"));
  std::size_t numbers = 0;
  for (const VectorCase& c : read_vectors(PARIAN_TEST_DATA "/vectors.json")) numbers += std::abs(c.eta - 1.3) < 1e-6;
  EXPECT_GT(numbers, 10U);
}

INSTANTIATE_TEST_SUITE_P(Locale, FilesInLocale, testing::Values(test::Library::c, test::Library::cpp),
                         test::library_name);

}  // namespace
}  // namespace parian
