// The command line on meshes and pictures whose contents are odd: what it says, and what it goes on from.
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "io/image_file.hpp"
#include "test_command.hpp"

namespace parian {
namespace {

using test::Outcome;
using test::read_bytes;

class CliInput : public test::CommandTest {};

TEST_F(CliInput, ResumeBelievesNoPictureThatClaimsWhatCantBe) {
  const std::string resume = "reference tet.obj --size 8x8 --error 0 --time 1 --quiet --resume -o ";
  ASSERT_EQ(run("reference tet.obj --size 8x8 --error 1e6 --quiet -o good.exr").code, 0);
  const Image good = read_image(scratch_ / "good.exr");
  const auto found = read_notes(scratch_ / "good.exr");
  PictureNotes notes;
  notes.other = {{"fingerprint", found.at("fingerprint")}, {"batches", "16"}, {"samples", found.at("samples")}};
  const auto refuses = [&](const Image& image, const PictureNotes& claims, const std::string& says) {
    write_image(scratch_ / "bad.exr", image, claims, {});
    const std::string before = read_bytes(scratch_ / "bad.exr");
    expect_error(resume + "bad.exr", 3, says);
    EXPECT_TRUE(read_bytes(scratch_ / "bad.exr") == before);
  };
  for (const char* batches : {"4294967295", "nan", "-5", "1e9", "16.5", "1", ""}) {
    PictureNotes claims = notes;
    claims.other["batches"] = batches;
    refuses(good, claims, "bad.exr: --resume: ");
  }
  for (const char* samples : {"4294967295", "nan", "9", "0"}) {
    PictureNotes claims = notes;
    claims.other["samples"] = samples;
    refuses(good, claims, "bad.exr: --resume: ");
  }
  Image image = good;
  image.rgba[0] = NAN;
  refuses(image, notes, "isn't finite");
  image = good;
  image.standard_error[0] = -1;
  refuses(image, notes, "negative standard error");
  image = {4, 4, std::vector<float>(64, 1.0F)};  // the note that says which scene it is of can be copied
  image.standard_error.assign(48, 0.1F);
  refuses(image, notes, "has 4x4 pixels");
  write_image(scratch_ / "fine.exr", good, notes, {});
  EXPECT_EQ(run(resume + "fine.exr").code, 0);
}

TEST_F(CliInput, GivenNormalsAreRenderedAndReferencedAlike) {
  // A pyramid over a square, with normals that lean far to one side.
  const std::string shape = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 0 1 0\nvn 0.6 0.8 0\nvn -0.6 -0.8 0\n";
  const auto faces = [](const std::string& side, const std::string& base) {
    std::string text;
    for (const char* face : {"5 2 1", "5 3 2", "5 4 3", "5 1 4", "1 2 3", "1 3 4"}) {
      std::istringstream corners(face);
      text += "f";
      for (std::string corner; corners >> corner;) text += " " + corner + (face[0] == '5' ? side : base);
      text += "\n";
    }
    return text;
  };
  scratch_.write("given.obj", shape + faces("//1", "//2"));
  scratch_.write("plain.obj", shape.substr(0, shape.find("vn")) + faces("", ""));
  const std::string how = " --size 32x32 --light 0.2,1,0.3 --camera 80,160,240:0,0,0 --quiet ";
  ASSERT_EQ(run("render given.obj -o render.exr --error 1e-3" + how).code, 0);
  ASSERT_EQ(run("reference given.obj -o given.exr --error 2e-4" + how).code, 0);
  ASSERT_EQ(run("reference plain.obj -o plain.exr --error 2e-4" + how).code, 0);
  const auto relmse = [&](const std::string& reference) {
    return nlohmann::json::parse(run("compare render.exr " + reference + " --json").out)["relmse"].get<double>();
  };
  EXPECT_LT(relmse("given.exr"), 5e-3);  // five times what was asked for: the light map's resolution is not in that
  EXPECT_GT(relmse("plain.exr"), 10 * relmse("given.exr"));
}

TEST_F(CliInput, WhatAMeshHoldsAndLacksIsSaid) {
  scratch_.write("face2.obj", std::string(test::tetrahedron) + "usemtl red\nf 1 2\n");
  const Outcome outcome = run("render face2.obj -o a.exr --dry-run --quiet");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("parian: warning: face2.obj: a face of fewer than three corners is left out, the first in "
                             "line 10"),
            std::string::npos)
      << outcome.err;
  EXPECT_NE(outcome.err.find("parian: warning: face2.obj: what else the file holds is left out (materials)"),
            std::string::npos)
      << outcome.err;
  scratch_.write("inverse.toml",
                 "[[object]]\nmesh = \"tet.obj\"\nmaterial = \"a\"\n[material.a]\nsigma_s = [1, 1, 1]\n"
                 "sigma_a = [0.01, 0.01, 0.01]\nior = 0.8\n");
  for (const char* command :
       {"render inverse.toml --dry-run", "reference inverse.toml -o a.exr --size 8x8 --error 1e6"})
    EXPECT_NE(run(command).err.find("parian: warning: material 'a': ior 0.8 is below 1"), std::string::npos) << command;
  // A needle beside a ball, a thousandth of a pixel wide.
  scratch_.write("needle.off",
                 "OFF\n8 8 0\n60 0 0\n100 0 0\n60 40 0\n60 0 40\n-0.001 50 0\n0.001 50 0\n0 50 0.002\n"
                 "0 -50 0\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n3 4 5 6\n3 4 7 5\n3 5 7 6\n3 6 7 4\n");
  const std::string thin = run("render needle.off --size 64x64 --dry-run").err;
  EXPECT_NE(thin.find("1 of 2 parts are thinner than subpixel positions lie apart"), std::string::npos) << thin;
  EXPECT_EQ(run("render tet.obj --size 64x64 --dry-run").err.find("thinner"), std::string::npos);
  scratch_.write("a.glb", "glTF");
  expect_error("render a.glb -o a.exr", 3, "a.glb: glTF isn't read; export the mesh as .ply");
}

}  // namespace
}  // namespace parian
