// The report: statistics of curves on made-up data, the page and its data, and one small report from end to end.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "core/error.hpp"
#include "io/image_file.hpp"
#include "scratch.hpp"
#include "test_render.hpp"
#include "truth/convergence.hpp"
#include "truth/plot.hpp"
#include "truth/reference.hpp"
#include "truth/report.hpp"
#include "truth/report_pictures.hpp"
#include "xml.hpp"

namespace parian {
namespace {

using test::xml_problem;
constexpr double rounding = 1e-12;  // relative: a few operations in double

/// Six methods and one sweep of three sizes whose sampling errors are 0.4 / t, scaled by seed and configuration, where
/// frame n ends at n / 10 s; the bias is 2e-3.
Report made_up(std::uint32_t seeds = 5, double power = -1) {
  Report report;
  report.input = "a & b <c> \"d\".toml";
  report.date = "2026-01-01 00:00 UTC";
  report.command = "parian report 'a & b' -o report.html";
  report.scene = "'a & b'";
  report.reference_name = "truth.exr";
  report.reference_relmse = 1e-5;
  report.film = {16, 12};
  report.seeds = seeds;
  report.standard = 4;
  report.machine.device = "device <0>";
  report.comparisons = {{"Methods", "", {0, 1, 2, 3, 4, 5}, {}},
                        {"Layer size", "layer-size", {6, 4, 7}, {128, 256, 512}}};
  for (const char* name :
       {"poster’s disc", "poster’s disc, no pyramids", "exponential radii", "exponential radii, no pyramids", "Parian",
        "Parian, no pyramids", "layer-size 128", "layer-size 512"})
    report.configurations.push_back({name, "--option", 2e-3, 1e-6, 128});
  for (std::uint32_t seed = 0; seed < seeds; ++seed)
    for (std::uint32_t c = 0; c < report.configurations.size(); ++c) {
      ReportRun run{c, seed, 1.5, 0.25, {}};
      for (const std::uint32_t frames : {1U, 2U, 4U, 8U, 16U}) {
        const double t = 0.1 * frames, e = 0.04 * std::pow(t / 0.1, power) * (1 + 0.1 * seed) * (1 + c);
        run.checkpoints.push_back({frames, t, 0.5 * t, 1e6 * frames, e + 2e-3, e, std::optional(1.1 * e)});
      }
      report.runs.push_back(run);
    }
  const Image dot{2, 1, {0.5F, 0.25F, 1.0F, 1.0F, 0.0F, 0.0F, 0.0F, 0.0F}, -1.0, {}};
  report.pictures = {{"Row & row", {{"Reference", 2, 1, png_base64(dot, 0.0)}}}};
  return report;
}

TEST(Report, MedianAndSpread) {
  const Spread odd = spread({3, 1, 2}), even = spread({4, 1, 3, 2}), one = spread({7});
  EXPECT_EQ(odd.low, 1);
  EXPECT_EQ(odd.median, 2);
  EXPECT_EQ(odd.high, 3);
  EXPECT_EQ(even.median, 2.5);
  EXPECT_EQ(one.median, 7);
  EXPECT_EQ(spread({1, INFINITY, INFINITY}).median, INFINITY);
  EXPECT_EQ(spread({INFINITY, INFINITY}).median, INFINITY);
}

TEST(Report, CurvesAreMediansOverSeeds) {
  const Report report = made_up();
  const auto points = curve(report, 1, Timing::wall, Against::sampling);
  ASSERT_EQ(points.size(), 5U);
  EXPECT_EQ(points[2].frames, 4U);
  EXPECT_NEAR(points[2].seconds.median, 0.4, 0.4 * rounding);
  EXPECT_NEAR(points[2].error.low, 0.02, 0.02 * rounding);
  EXPECT_NEAR(points[2].error.median, 0.024, 0.024 * rounding);
  EXPECT_NEAR(points[2].error.high, 0.028, 0.028 * rounding);
  EXPECT_NEAR(curve(report, 1, Timing::kernel, Against::sampling)[2].seconds.median, 0.2, 0.2 * rounding);
}

TEST(Report, CurvesEndWhereASeedDoesAndNeedTheirClock) {
  Report report = made_up();
  report.runs[1].checkpoints.resize(2);
  EXPECT_EQ(curve(report, 1, Timing::wall, Against::sampling).size(), 2U);
  report.runs[1].checkpoints[0].kernel_seconds.reset();
  EXPECT_TRUE(curve(report, 1, Timing::kernel, Against::sampling).empty());
  EXPECT_FALSE(time_to(report, 1, 0.1, Timing::kernel, Against::sampling));
}

TEST(Report, SlopesOfPowersAreTheirExponents) {
  for (const double power : {-1.0, -1.37, -0.5}) {
    const auto k = slope(curve(made_up(5, power), 4, Timing::wall, Against::sampling));
    ASSERT_TRUE(k);
    EXPECT_NEAR(*k, power, 1e-9) << "logarithms lose a few digits";
  }
  const std::vector<CurvePoint> two = {{1, {1, 1, 1}, {1, 1, 1}}, {2, {2, 2, 2}, {1, 1, 1}}};
  EXPECT_FALSE(slope(two)) << "two points are no fit";
}

TEST(Report, TimesAreInterpolatedExtrapolatedOrNever) {
  const Report report = made_up(1);  // configuration 0: sampling error 0.004 / t up to 1.6 s
  const auto within = time_to(report, 0, 0.01, Timing::wall, Against::sampling);
  EXPECT_NEAR(within->seconds.median, 0.4, 1e-9);
  EXPECT_FALSE(within->extrapolated || within->at_first || within->never);
  const auto first = time_to(report, 0, 0.1, Timing::wall, Against::sampling);
  EXPECT_EQ(first->seconds.median, 0.1);
  EXPECT_TRUE(first->at_first);
  const auto beyond = time_to(report, 0, 0.001, Timing::wall, Against::sampling);
  EXPECT_NEAR(beyond->seconds.median, 4.0, 1e-9);
  EXPECT_TRUE(beyond->extrapolated);
  // Against the reference the bias of 0.002 stays.
  EXPECT_TRUE(time_to(report, 0, 0.001, Timing::wall, Against::reference)->never);
  const auto total = time_to(report, 0, 0.003, Timing::wall, Against::reference);
  EXPECT_NEAR(total->seconds.median, 4.0, 1e-9);
  EXPECT_TRUE(total->extrapolated);
  EXPECT_NEAR(time_to(report, 0, 0.012, Timing::wall, Against::reference)->seconds.median, 0.4, 1e-9);
}

TEST(Report, BiasLostInNoiseHoldsNothingBack) {
  Report report = made_up(1);
  EXPECT_EQ(resolved_bias(report, 0), 2e-3);
  EXPECT_EQ(bias_text(report, 0), power_text(2e-3));
  report.configurations[0].limit_relmse = 0.1;  // a tenth of it, and of the reference's 1e-5, is more than the bias
  EXPECT_EQ(resolved_bias(report, 0), 0);
  EXPECT_EQ(bias_text(report, 0), "< " + power_text(1e-2));
  EXPECT_FALSE(time_to(report, 0, 0.001, Timing::wall, Against::reference)->never);
}

TEST(Report, TimesToldAsTheMedianSeedHasThem) {
  const Report report = made_up(5);  // 0.1 s x 0.04 (1 + 0.1 seed) / 0.0025
  const auto time = time_to(report, 0, 0.0025, Timing::wall, Against::sampling);
  EXPECT_NEAR(time->seconds.low, 1.6, 1e-9);
  EXPECT_NEAR(time->seconds.median, 1.92, 1e-9);
  EXPECT_NEAR(time->seconds.high, 2.24, 1e-9);
  EXPECT_TRUE(time->extrapolated);
  EXPECT_EQ(time_text(*time), "≈\u00a01.9\u00a0s");
}

TEST(Report, NumbersForPeople) {
  EXPECT_EQ(time_text(0.0123), "12\u00a0ms");
  EXPECT_EQ(time_text(3.14), "3.1\u00a0s");
  EXPECT_EQ(time_text(59.0), "59\u00a0s");
  EXPECT_EQ(time_text(600.0), "10\u00a0min");
  EXPECT_EQ(time_text(36000.0), "10\u00a0h");
  EXPECT_EQ(power_text(1e-3), "10⁻³");
  EXPECT_EQ(power_text(2.14e-12), "2.1\u00a0×\u00a010⁻¹²");
  EXPECT_EQ(power_text(9.99e-4), "10⁻³");
  EXPECT_EQ(power_text(0), "0");
}

TEST(Report, PicturesAreTextOfWholePngs) {
  for (const std::uint32_t width : {1U, 2U, 3U, 50U}) {
    const Image row{width, 1, std::vector<float>(4 * width, 0.5F), -1.0, {}};
    const std::string text = png_base64(row, 0.0);
    EXPECT_EQ(text.size() % 4, 0U);
    EXPECT_TRUE(text.starts_with("iVBORw0KGgo")) << text;
    const auto end = text.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/");
    EXPECT_EQ(end, text.find('=')) << text;
    EXPECT_TRUE(end == std::string::npos || text.size() - end <= 2) << text;
  }
}

TEST(Report, BrokenXmlIsSeen) {
  for (const char* bad : {"", "<a>", "<a></b>", "<a>&</a>", "<a>&nothing;</a>", "<a b=1/>", "<a/><b/>", "<a>\xff</a>"})
    EXPECT_NE(xml_problem(bad), "") << bad;
  EXPECT_EQ(xml_problem("<a b='1'>&lt; > é</a>"), "");
}

TEST(Report, PlotsStandAloneAndShowEverySeries) {
  Plot plot;
  plot.title = "a < b & c";
  plot.series = {
      {"one", "slope −1", "#000", Marker::circle, false, true, {{1, 1, 2, 3, "p"}, {10, 0, 0.2, 0.3, "q"}}, 0.1},
      {"<two>", "", "#111", Marker::diamond, true, false, {{2, 1, 1, 1, ""}, {3, 0, 0, 0, "none"}}, {}},
      {"nothing", "", "#222", Marker::square, false, false, {{1, NAN, NAN, NAN, ""}}, {}}};
  for (const Plot& p : {plot, Plot()}) {
    const std::string svg = plot_svg(p);
    EXPECT_EQ(xml_problem(svg), "");
    for (const char* bad : {"nan", "inf", "<script", "href", "url("})
      EXPECT_EQ(svg.find(bad), std::string::npos) << bad;
  }
  const std::string svg = plot_svg(plot);
  for (const char* part : {"&lt;two&gt;", "one", "slope −1", "stroke-dasharray=\"1.5 3\""})
    EXPECT_NE(svg.find(part), std::string::npos) << part;
}

TEST(Report, PageIsWellFormedAndWhole) {
  Report report = made_up();
  report.configurations[0].limit_relmse = 1;  // its bias is told as less than something
  const std::string page = report_html(report);
  EXPECT_EQ(xml_problem(page), "");
  for (const Configuration& c : report.configurations) EXPECT_NE(page.find(c.name), std::string::npos) << c.name;
  EXPECT_NE(page.find("256 (default)"), std::string::npos);
  for (const char* part : {"a &amp; b &lt;c&gt; &quot;d&quot;.toml", "device &lt;0&gt;", "Row &amp; row", "≈", "never",
                           "data:image/png;base64,iVBOR"})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  // The lines of the methods in each of the three plots of them, and the sweep's three.
  std::size_t curves = 0;
  for (std::size_t i = page.find("fill-opacity"); i != std::string::npos; i = page.find("fill-opacity", i + 1))
    ++curves;
  EXPECT_EQ(curves, 3U * 6 + 3);
  for (const char* bad : {"<script", "href", "src=\"http", "@import", "url(", "<link", "nan", "inf "})
    EXPECT_EQ(page.find(bad), std::string::npos)
        << bad << ": a page that needs something else, or a number that is none";
}

TEST(Report, PageFollowsFromTheData) {
  const Report report = made_up();
  const Report read = read_report(report_json(report));
  EXPECT_EQ(report_json(read), report_json(report));
  EXPECT_EQ(report_html(read), report_html(report));
  EXPECT_EQ(report_csv(read), report_csv(report));
  EXPECT_EQ(report_markdown(read), report_markdown(report));
}

TEST(Report, UnknownNumbersStayUnknown) {
  Report report = made_up();
  for (ReportRun& run : report.runs)
    for (Checkpoint& point : run.checkpoints) point.kernel_seconds.reset(), point.estimated_relmse.reset();
  report.reference_relmse.reset();
  const Report read = read_report(report_json(report));
  EXPECT_FALSE(read.runs[0].checkpoints[0].kernel_seconds);
  EXPECT_FALSE(read.reference_relmse);
  const std::string page = report_html(read);
  EXPECT_EQ(xml_problem(page), "");
  EXPECT_NE(page.find("kernel times are not known"), std::string::npos);
}

TEST(Report, OtherJsonIsRefused) {
  for (const char* text : {"", "{", "[]", "{\"schema\":\"else\"}", "{\"schema\":\"parian-report-1\"}"})
    EXPECT_THROW((void)read_report(text), Error) << text;
}

TEST(Report, CsvHasARowPerRunAndCheckpoint) {
  const Report report = made_up();
  const std::string csv = report_csv(report);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 5 * 8 * 5);
  EXPECT_NE(csv.find("\"poster’s disc, no pyramids\",--option,0,1,"), std::string::npos) << csv.substr(0, 400);
}

TEST(Report, ToldToStopItKeepsWholeSeeds) {
  const Scene scene = test::bare_scene(test::model("sphere"), find_material("skimmilk"), {16, 12});
  ReferenceSettings well;
  well.target = 0.1;
  ReferenceState state;
  render_reference(scene, well, state);
  Settings settings;
  settings.layers = 2;
  settings.layer_size = settings.light_map_size = 32;
  settings.samples = 2;
  ReportSettings how;
  how.seeds = 3;
  how.frames = how.sweep_frames = 1;
  int asked = 0;
  const auto stopped_after = [&](int times) {
    asked = 0;
    how.stop = [&asked, times] { return asked++ >= times; };
    return measure(scene, settings, test_selector(), reference_image(state), how);
  };
  EXPECT_EQ(stopped_after(0).seeds, 0U);
  // Asked before each limit, after them and before each run, of 12 configurations: in the middle of the second seed.
  const Report report = stopped_after(12 + 1 + 12 + 5);
  EXPECT_EQ(report.seeds, 1U);
  EXPECT_EQ(report.runs.size(), 12U);
  EXPECT_EQ(xml_problem(report_html(report)), "");
}

TEST(Report, FromEndToEnd) {
  const test::Scratch scratch;
  const std::string tool = "cd '" + scratch.folder().string() + "' && '" PARIAN_BINARY "' ";
  const std::string scene = " '" PARIAN_MESHES "/sphere.ply' --size 20x16 --material skimmilk ";
  const auto run = [&](const std::string& arguments) {
    const int status = std::system((tool + arguments + " >out.txt 2>err.txt </dev/null").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  ASSERT_EQ(run("reference" + scene + "--error 0.1 -o truth.exr"), 0) << test::read_bytes(scratch / "err.txt");
  const std::string small = "--layers 2 --layer-size 32 --light-map-size 32 --samples 2 --seeds 2 --frames 2 ";
  ASSERT_EQ(run("report" + scene + small + "--reference truth.exr -o page.html"), 0)
      << test::read_bytes(scratch / "err.txt");
  const std::string page = test::read_bytes(scratch / "page.html");
  EXPECT_EQ(xml_problem(page), "");
  EXPECT_LT(page.size(), 3U << 20);
  const Report report = read_report(test::read_bytes(scratch / "page.json"));
  EXPECT_EQ(report_html(report), page);
  EXPECT_EQ(report.configurations.size(), 12U);
  EXPECT_EQ(report.runs.size(), 24U);
  EXPECT_GT(report.pixels, 20U);
  for (const ReportRun& r : report.runs) {
    ASSERT_EQ(r.checkpoints.size(), 2U);
    for (const Checkpoint& p : r.checkpoints) {
      EXPECT_GT(p.seconds, 0);
      EXPECT_TRUE(p.relmse >= 0 && std::isfinite(p.relmse)) << p.relmse;
      EXPECT_TRUE(p.sampling_relmse >= 0 && std::isfinite(p.sampling_relmse)) << p.sampling_relmse;
    }
    EXPECT_GT(r.checkpoints[1].evaluations, r.checkpoints[0].evaluations);
  }
  const std::string csv = test::read_bytes(scratch / "page.csv"), summary = test::read_bytes(scratch / "page.md");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 24 * 2);
  EXPECT_NE(summary.find("| Parian |"), std::string::npos);
  EXPECT_EQ(run("report" + scene + "--reference missing.exr -o page.html"), 3);
  EXPECT_EQ(run("report" + scene + "-o page.pdf"), 2);
  EXPECT_EQ(run("report" + scene + "--seeds 0 -o page.html"), 2);
  EXPECT_EQ(run("report" + scene + "--estimator disc -o page.html"), 2) << "the report chooses estimators itself";
}

}  // namespace
}  // namespace parian
