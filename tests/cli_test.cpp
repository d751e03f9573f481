// The command line as a user meets it: exit codes, one line per mistake, help and lists.
#include <nlohmann/json.hpp>

#include <algorithm>

#include "test_command.hpp"

namespace parian {
namespace {

using test::Outcome;
using test::read_bytes;

class CliTest : public test::CommandTest {};

TEST_F(CliTest, HelpAndVersion) {
  EXPECT_EQ(run("--help").code, 0);
  EXPECT_NE(run("--help").out.find("materials"), std::string::npos);
  EXPECT_EQ(run("--version").out.rfind("parian ", 0), 0u);
  const Outcome help = run("render --help");
  EXPECT_EQ(help.code, 0);
  for (const char* word : {"How well", "--layer-size N", "(256)", "--disc-radius MM", "--light X,Y,Z[:R,G,B]",
                           "--exposure STOPS|auto", "Examples"}) {
    EXPECT_NE(help.out.find(word), std::string::npos) << word;
  }
}

TEST_F(CliTest, BadUsageIs2) {
  const std::string render = "render tet.obj -o a.exr ";
  expect_error("", 2, "parian --help");
  expect_error("rendre", 2, "did you mean 'render'?");
  expect_error("render", 2, "INPUT is required");
  expect_error("render tet.obj", 2, "add -o FILE");
  expect_error(render + "--frmaes 3", 2, "did you mean '--frames'?");
  expect_error(render + "b.obj", 2, "'b.obj'");
  expect_error(render + "--frames", 2, "needs a value");
  for (const char* value : {"0", "-1", "1.5", "many", "1e99", "nan", "''"}) {
    expect_error(render + "--frames " + value, 2, "--frames");
  }
  expect_error(render + "--error -1", 2, "--error: -1 is out of range");
  expect_error(render + "--error 1,5", 2, "'1,5' is not a number");
  expect_error(render + "--time inf", 2, "--time");
  expect_error(render + "--samples 3", 2, "even");
  expect_error(render + "--model best", 2, "directional, standard, better");
  expect_error(render + "--light-map-shift maybe", 2, "on or off");
  expect_error(render + "--disc-radius 2", 2, "estimator");
  expect_error(render + "--exposure bright", 2, "auto");
  expect_error(render + "--size-mm 0", 2, "--size-mm");
  expect_error(render + "--fov 180", 2, "above 0 and below 180");
  for (const char* value : {"12", "12x", "0x5", "x", "16385x1", "-1x5", "1x1x1", "1.5x2"}) {
    expect_error(render + "--size " + value, 2, "WxH");
  }
  for (const char* value : {"1,2", "1,2,3,4", "a,b,c", "1,2,3:", "1,2,3:1", "1,2,", "nan,0,0"}) {
    expect_error(render + "--light " + value, 2, "X,Y,Z:R,G,B");
  }
  expect_error(render + "--light 0,0,0", 2, "no length");
  expect_error(render + "--light 0,0,1:1,-1,1", 2, "irradiance");
  for (const char* value : {"1,2,3", "1,2,3:1,2", ":"}) expect_error(render + "--camera " + value, 2, "EX,EY,EZ");
  expect_error(render + "--camera 1,2,3:1,2,3", 2, "same point");
  expect_error(render + "--camera 1,2,3:0,0,0 --cameras c.toml", 2, "keep one");
  expect_error(render + "--material marbel", 2, "arble");
}

TEST_F(CliTest, BadInputIs3) {
  expect_error("render none.obj -o a.exr", 3, "none.obj");
  expect_error("render none.toml -o a.exr", 3, "none.toml");
  expect_error("render tet.obj -o a.exr --cameras none.toml", 3, "none.toml");
  scratch_.write("typo.toml", "[[object]]\nmehs = \"tet.obj\"\n");
  expect_error("render typo.toml -o a.exr", 3,
               "typo.toml:2: there is no key 'mehs' in [[object]]; did you mean 'mesh'?");
  scratch_.write("syntax.toml", "a = = 3\n");
  expect_error("render syntax.toml -o a.exr", 3, "syntax.toml:1: ");
  scratch_.write("two.toml", "[[object]]\nmesh = \"tet.obj\"\n[[object]]\nmesh = \"tet.obj\"\n");
  expect_error("render two.toml -o a.exr", 3, "two.toml:3: a second");
  scratch_.write("cameras.toml", "[[camera]]\n[[camera]]\n");
  expect_error("render tet.obj -o a.exr --cameras cameras.toml", 2, "picture_%03d.exr");
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "a.exr"));
}

TEST_F(CliTest, NoDeviceIs4) {
  expect_error("render tet.obj -o a.exr --device 'no such device'", 4, "no such device");
  const Outcome outcome = run("render tet.obj -o a.exr", "PARIAN_DEVICE='no such device'");
  EXPECT_EQ(outcome.code, 4);
  EXPECT_NE(outcome.err.find("no such device"), std::string::npos) << outcome.err;
}

TEST_F(CliTest, BadOutputIs5BeforeAnythingIsRead) {
  expect_error("render none.obj -o a.xyz", 5, "use .exr or .png");
  expect_error("render none.obj -o a", 5, "end it in .exr or .png");
  expect_error("render none.obj -o none/a.exr", 5, "create it first");
  expect_error("render none.obj -o /dev/full", 5, "/dev/full");
  expect_error("render none.obj -o a.exr --stats none/s.json", 5, "create it first");
  expect_error("render none.obj -o a.exr -o b.xyz", 5, "b.xyz");
}

TEST_F(CliTest, ListsMaterials) {
  const auto list = nlohmann::json::parse(run("materials --json").out);
  ASSERT_FALSE(list.empty());
  for (const auto& material : list) {
    for (const char* key :
         {"name", "dataset", "sigma_s", "sigma_a", "g", "ior", "mean_free_path_mm", "reduced_albedo"}) {
      EXPECT_TRUE(material.contains(key)) << key;
    }
  }
  const auto marble = std::find_if(list.begin(), list.end(), [](const auto& m) { return m["name"] == "Marble"; });
  ASSERT_NE(marble, list.end());
  EXPECT_NEAR((*marble)["mean_free_path_mm"][0].get<double>(), 1 / (2.19 + 0.0021), 1e-12);
  EXPECT_NEAR((*marble)["reduced_albedo"][0].get<double>(), 2.19 / (2.19 + 0.0021), 1e-12);
  const Outcome table = run("materials");
  EXPECT_EQ(table.code, 0);
  EXPECT_NE(table.out.find("Marble"), std::string::npos);
  EXPECT_NE(table.out.find("\n* "), std::string::npos) << "the footnote";
}

TEST_F(CliTest, ListsDevices) {
  const Outcome outcome = run("devices --json");
  const auto list = nlohmann::json::parse(outcome.out);
  ASSERT_TRUE(list.is_array());
  EXPECT_EQ(outcome.code, list.empty() ? 4 : 0);
  for (const auto& device : list) {
    for (const char* key : {"name", "platform", "driver", "version", "type", "compute_units", "vector_width",
                            "max_work_group", "global_memory", "max_allocation", "local_memory"})
      EXPECT_TRUE(device.contains(key)) << key;
    EXPECT_GT(device["local_memory"].get<std::uint64_t>(), 0U);
    EXPECT_EQ(device["self_test"]["passed"].get<bool>(), device["self_test"]["failed"].empty());
  }
  const Outcome table = run("devices");
  EXPECT_EQ(table.code, outcome.code);
  for (const auto& device : list) EXPECT_NE(table.out.find(device["name"]), std::string::npos) << table.out;
  EXPECT_NE(table.out.find("self-test passed"), std::string::npos) << table.out;
}

const std::string small = test::small_render;

TEST_F(CliTest, StatisticsHaveAllTheirKeys) {
  ASSERT_EQ(run(small + "--frames 2 -o a.exr -o a.png --stats s.json --quiet").code, 0);
  const nlohmann::json s = nlohmann::json::parse(read_bytes(scratch_ / "s.json"));
  for (const char* key : {"/schema",
                          "/version",
                          "/device/name",
                          "/device/platform",
                          "/device/driver",
                          "/device/compute_units",
                          "/device/vector_width",
                          "/film/1",
                          "/frames",
                          "/stopped_by",
                          "/estimated_relmse",
                          "/estimated_bias_relmse",
                          "/evaluations",
                          "/seconds/load",
                          "/seconds/plan",
                          "/seconds/compile",
                          "/seconds/light_map",
                          "/seconds/layers",
                          "/seconds/pyramids",
                          "/seconds/gather",
                          "/seconds/read",
                          "/seconds/total",
                          "/kernel_seconds/layers",
                          "/layers/count",
                          "/layers/size",
                          "/layers/covered",
                          "/layers/texels",
                          "/layers/texels_evaluated",
                          "/further_view_seconds",
                          "/fallback_pixels",
                          "/bytes/peak",
                          "/bytes/planned",
                          "/left_out/0/what",
                          "/left_out/0/why",
                          "/left_out/0/saves/unit",
                          "/left_out/0/saves/count",
                          "/left_out/0/saves/estimated",
                          "/nonfinite",
                          "/warnings"}) {
    EXPECT_TRUE(s.contains(nlohmann::json::json_pointer(key))) << key;
  }
  EXPECT_EQ(s["frames"], 2);
  EXPECT_EQ(s["stopped_by"], "frames");
  EXPECT_EQ(s["nonfinite"], 0);
  EXPECT_GT(s["estimated_relmse"], 0.0);
}

const std::string small_bench = "bench" + small.substr(6) + "--light-map-size 64 ";

TEST_F(CliTest, BenchSetsEachPassBesideThePeak) {
  const Outcome outcome = run(small_bench + "--json");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const nlohmann::json b = nlohmann::json::parse(outcome.out);
  for (const char* key : {"schema", "version", "device", "load", "film", "triangles", "material", "layers", "peak",
                          "runs", "frames", "estimated_relmse", "once_seconds", "evaluations_per_second", "passes"}) {
    EXPECT_TRUE(b.contains(key)) << key;
  }
  EXPECT_FALSE(b.contains("poster"));
  EXPECT_GT(b["peak"]["rate"]["median"], 0.0);
  EXPECT_EQ(b["subpixel_positions"], 64);
  ASSERT_EQ(b["passes"].size(), 4u);
  const char* names[] = {"light_map", "layers", "pyramids", "gather"};
  for (std::size_t i = 0; i < 4; ++i) {
    const nlohmann::json& pass = b["passes"][i];
    EXPECT_EQ(pass["name"], names[i]);
    EXPECT_LE(pass["seconds"]["min"], pass["seconds"]["median"]);
    EXPECT_LE(pass["seconds"]["median"], pass["seconds"]["max"]);
    ASSERT_FALSE(pass["parts"].empty()) << names[i];
    for (const nlohmann::json& part : pass["parts"]) {
      for (const char* key : {"count", "per_second", "operations_per_unit", "share_of_peak", "bytes_per_unit"}) {
        EXPECT_GT(part[key], 0.0) << names[i] << ' ' << part["name"] << ' ' << key;
      }
      EXPECT_LT(part["share_of_peak"], 1.0) << names[i];
    }
  }
  // Sixteen samples a texel, three channels.
  EXPECT_EQ(b["passes"][1]["parts"][0]["count"], 48.0 * b["layers"]["texels_evaluated"].get<double>());
  EXPECT_EQ(b["passes"][1]["parts"][0]["per_second"], b["evaluations_per_second"]);
}

TEST_F(CliTest, BenchSetsThePostersFrameBesideItsTimes) {
  const std::string poster = "bench '" PARIAN_MESHES "/torus.ply' --size 16x16 --poster ";
  const Outcome outcome = run(poster);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("57.59"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("layers of 512 x 512"), std::string::npos) << outcome.out;
  expect_error(poster + "--samples 4", 2, "--poster sets --samples");
}

TEST_F(CliTest, BenchLeavesOutWhatASceneDoesNotHave) {
  const Outcome outcome = run(small_bench + "--no-pyramids --json");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["passes"].size(), 3u);
  const Outcome camera = run(small_bench + "--gather camera --json");
  ASSERT_EQ(camera.code, 0) << camera.err;
  const nlohmann::json b = nlohmann::json::parse(camera.out);
  ASSERT_EQ(b["passes"].size(), 4u);
  EXPECT_EQ(b["passes"][3]["name"], "gather");
  expect_error("bench", 2, "INPUT is required");
  expect_error("bench none.obj", 3, "none.obj");
  expect_error("bench tet.obj --frames 3", 2, "there is no option '--frames'");
  expect_error("bench tet.obj --device 'no such device'", 4, "no such device");
}

TEST_F(CliTest, ExplainsThePlanWithoutRendering) {
  const Outcome plan = run(small + "--dry-run --gather layers --keep clipping");
  EXPECT_EQ(plan.code, 0) << plan.err;
  EXPECT_NE(plan.out.find("unread-texels"), std::string::npos) << plan.out;
  EXPECT_EQ(plan.out.find("left out  clipping"), std::string::npos) << plan.out;
  EXPECT_EQ(plan.out.find("saves 0 "), std::string::npos) << plan.out;
  expect_error(small + "--dry-run --keep nonsense", 2, "choose all or one of");
}

TEST_F(CliTest, ReferenceWritesContinuesAndIsCompared) {
  const std::string options = "tet.obj --size 12x12 --error 1e6 --quiet ";
  ASSERT_EQ(run("reference " + options + "-o a.exr -o a.png").code, 0);
  EXPECT_FALSE(read_bytes(scratch_ / "a.png").empty());
  ASSERT_EQ(run("reference " + options + "-o again.exr").code, 0);
  EXPECT_TRUE(read_bytes(scratch_ / "a.exr") == read_bytes(scratch_ / "again.exr"));  // the same run, the same bytes

  ASSERT_EQ(run("reference " + options + "--resume -o again.exr").code, 0);  // its target is reached already
  EXPECT_TRUE(read_bytes(scratch_ / "a.exr") == read_bytes(scratch_ / "again.exr"));
  ASSERT_EQ(run("reference tet.obj --size 12x12 --error 5e-5 --quiet --resume -o again.exr").code, 0);
  EXPECT_TRUE(read_bytes(scratch_ / "a.exr") != read_bytes(scratch_ / "again.exr"));
  const std::string before = read_bytes(scratch_ / "again.exr");
  expect_error("reference " + options + "--light 0,1,0 --resume -o again.exr", 3, "was made of another scene");
  EXPECT_TRUE(read_bytes(scratch_ / "again.exr") == before);

  const Outcome json = run("compare a.exr again.exr --json");
  ASSERT_EQ(json.code, 0) << json.err;
  const auto figures = nlohmann::json::parse(json.out);
  for (const char* key : {"pixels", "rmse", "relmse", "relmse_p99", "relmse_edge", "reference_relmse", "mean_ratio",
                          "max_abs", "max_pixel"}) {
    EXPECT_TRUE(figures.contains(key)) << key;
  }
  EXPECT_GT(figures["pixels"], 0);
  EXPECT_GT(figures["reference_relmse"], 0.0);
  EXPECT_EQ(figures["mean_ratio"].size(), 3u);
  const Outcome table = run("compare a.exr again.exr --difference d.png --scale 0.5");
  EXPECT_EQ(table.code, 0) << table.err;
  EXPECT_NE(table.out.find("relMSE"), std::string::npos);
  EXPECT_FALSE(read_bytes(scratch_ / "d.png").empty());
}

TEST_F(CliTest, CompareFailsWhenItShould) {
  ASSERT_EQ(run("reference tet.obj --size 8x8 --error 1e6 --quiet -o a.exr -o a.png").code, 0);
  ASSERT_EQ(run("reference tet.obj --size 8x8 --error 1e6 --quiet --material skin2 -o b.exr").code, 0);
  ASSERT_EQ(run("reference tet.obj --size 9x8 --error 1e6 --quiet -o c.exr").code, 0);
  EXPECT_EQ(run("compare a.exr a.exr --max-relmse 0").code, 0);
  const Outcome exceeded = run("compare b.exr a.exr --max-relmse 1e-6 --json");
  EXPECT_EQ(exceeded.code, 1);
  EXPECT_NE(exceeded.err.find("exceeds 1e-06"), std::string::npos) << exceeded.err;
  EXPECT_TRUE(nlohmann::json::accept(exceeded.out));
  expect_error("compare a.exr c.exr", 3, "c.exr");
  expect_error("compare a.exr none.exr", 3, "none.exr: there is no such file");
  expect_error("compare a.png a.exr", 3, "a.png: holds bytes");
  expect_error("compare a.exr a.exr --scale 1", 2, "--difference");
  expect_error("compare a.exr", 2, "REFERENCE");
}

TEST_F(CliTest, ReferenceRefusesWhatItCantUse) {
  expect_error("reference tet.obj", 2, "no output is given");
  expect_error("reference tet.obj -o a.exr --layers 4", 2, "there is no option '--layers'");
  expect_error("reference tet.obj -o a.exr --seed 1.5", 2, "whole number");
  expect_error("reference tet.obj -o a.png --resume", 2, "add -o FILE.exr");
  expect_error("reference tet.obj -o none/a.exr", 5, "there is no folder");
  scratch_.write("other.exr", "not ours");
  expect_error("reference tet.obj -o other.exr --resume", 3, "other.exr");
}

}  // namespace
}  // namespace parian
