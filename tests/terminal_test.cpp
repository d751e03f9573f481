// What the tool prints: results that are lost are told, names of others do nothing to a terminal, the bar keeps its
// row.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "io/image_file.hpp"
#include "test_command.hpp"
#include "test_terminal.hpp"

namespace parian {
namespace {

using test::OnTerminal;
using test::Outcome;

class TerminalTest : public test::CommandTest {
 protected:
  /// From here on nothing is said of compiling small_render's kernels.
  void compile() const { ASSERT_EQ(run(std::string(test::small_render) + "--dry-run --quiet").code, 0); }
};

TEST_F(TerminalTest, LongCompilingIsTold) {
  const std::string line = std::string(test::small_render) + "--dry-run --stats s.json ";
  for (const char* cache : {"cold", "warm"}) {
    const Outcome outcome = run(line, "POCL_CACHE_DIR=kernels");
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const auto seconds = nlohmann::json::parse(test::read_bytes(scratch_ / "s.json"))["seconds"];
    const double build = seconds["compile"], all = build + seconds["plan"].get<double>();
    if (outcome.err == "parian: compiling kernels (once)\n")
      EXPECT_TRUE(build > 0.2 && all > 0.9) << cache << ": " << build << " s of " << all;
    else
      EXPECT_TRUE(outcome.err.empty() && (build < 0.4 || all < 1.1)) << cache << '\n' << outcome.err;
  }
}

TEST_F(TerminalTest, LostResultsAre5InOneLine) {
  compile();
  ASSERT_EQ(run("reference tet.obj --size 8x8 --error 1e6 --quiet -o a.exr").code, 0);
  const std::string render = test::small_render;
  for (const std::string& arguments :
       {std::string("--version >&-"), std::string("--version >/dev/full"), std::string("--help >/dev/full"),
        std::string("check --help >/dev/full"), std::string("materials >/dev/full"),
        std::string("materials --json >&-"), std::string("devices --json >/dev/full"),
        std::string("compare a.exr a.exr >/dev/full"), std::string("compare a.exr a.exr --json >&-"),
        std::string("reference tet.obj --size 4x4 --error 1e6 -o b.exr >/dev/full"),
        std::string("check --vectors '" PARIAN_TEST_DATA "/vectors.json' >/dev/full"), render + "--dry-run >/dev/full",
        render + "--explain -o c.exr >/dev/full", render + "--error 0 --frames 1 -o d.exr >&-",
        fmt::format("bench {} --json >/dev/full", render.substr(7))})
    expect_one_line(run_shell("'" PARIAN_BINARY "' " + arguments + " 2>err.txt </dev/null"), 5, "standard output",
                    arguments);
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "c.exr")) << "the explanation was lost before anything was rendered";
  EXPECT_EQ(read_image(scratch_ / "d.exr").width, 40U);  // whole, though nothing could be said of it
}

TEST_F(TerminalTest, ClosedStreamsAreNoFiles) {
  const std::string line = std::string("'" PARIAN_BINARY "' ") + test::small_render + "--frames 1 --verbose -o a.exr ";
  EXPECT_EQ(run_shell(line + "--quiet >&- 2>err.txt <&-").code, 0);  // nothing to lose
  EXPECT_EQ(read_image(scratch_ / "a.exr").width, 40U);
  EXPECT_EQ(run_shell(line + ">out.txt 2>&- <&-").code, 0);
  EXPECT_EQ(read_image(scratch_ / "a.exr").width, 40U);
}

TEST_F(TerminalTest, LostMessagesChangeNoOutcome) {
  EXPECT_EQ(run_shell("'" PARIAN_BINARY "' rendre >out.txt 2>/dev/full").code, 2);
  const std::string render = test::small_render;
  EXPECT_EQ(run_shell("'" PARIAN_BINARY "' " + render + "--frames 1 --verbose -o a.exr >out.txt 2>/dev/full").code, 0);
}

/// Whether text has bytes that act on a terminal: control bytes but the ends of lines, C1 controls, marks of direction.
bool acts(const std::string& text) {
  for (const unsigned char c : text)
    if ((c < 0x20 && c != '\n') || c == 0x7f) return true;
  for (const char* character : {"\u0085", "\u009b", "\u2028", "\u202e", "\u2066"})
    if (text.find(character) != std::string::npos) return true;
  return text.find('\xff') != std::string::npos;
}

/// Every line on standard error is the tool's own.
void expect_harmless(const Outcome& outcome, const std::string& of) {
  EXPECT_FALSE(acts(outcome.out)) << of << '\n' << outcome.out;
  EXPECT_FALSE(acts(outcome.err)) << of << '\n' << outcome.err;
  std::istringstream lines(outcome.err);
  for (std::string line; std::getline(lines, line);) EXPECT_TRUE(line.starts_with("parian: ")) << of << '\n' << line;
}

TEST_F(TerminalTest, NamesOfOthersAreHarmless) {
  // Of a material, in TOML's notation, that absorbs so much that there is a warning of it.
  for (const char* name : {R"(x\ny)", R"(\u001b[31mred)", R"(\u009b2J)", R"(\u202eder)", R"(\u007f\u0007\r)"}) {
    scratch_.write("s.toml", fmt::format("[[object]]\nmesh = \"tet.obj\"\nmaterial = \"{0}\"\n[material.\"{0}\"]\n"
                                         "sigma_s = [1, 1, 1]\nsigma_a = [20, 1, 1]\n[film]\nsize = [8, 8]\n",
                                         name));
    const Outcome plan = run("render s.toml --dry-run --explain --verbose");
    EXPECT_EQ(plan.code, 0) << plan.err;
    EXPECT_NE(plan.err.find("warning: "), std::string::npos) << plan.err;
    expect_harmless(plan, name);
    expect_harmless(run("render s.toml --dry-run --material none"), name);
  }
  const Outcome bench = run("bench s.toml --layers 2 --layer-size 16 --light-map-size 16");
  EXPECT_EQ(bench.code, 0) << bench.err;
  expect_harmless(bench, "bench");
}

TEST_F(TerminalTest, NamesOfFilesAreHarmless) {
  const std::string name = "a\x1b]0;t\x07\nb\xc2\x9b\xff.obj";
  scratch_.write(name, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 2\nf 1 3 2\nf 1 2 4\nf 1 4 3\n");  // open: a warning
  const std::string quoted = "'" + name + "'";
  const Outcome rendered = run("render " + quoted + " --size 8x8 --frames 1 -o " + "'p\x1b[1m.exr'");
  EXPECT_EQ(rendered.code, 0) << rendered.err;
  EXPECT_NE(rendered.err.find("warning: "), std::string::npos) << rendered.err;
  EXPECT_NE(rendered.out.find(".exr: 1 frames"), std::string::npos) << rendered.out;
  expect_harmless(rendered, "render");
  const Outcome reference = run("reference " + quoted + " --size 8x8 --error 1e6 -o " + "'p\x1b[1m.exr'");
  EXPECT_EQ(reference.code, 0) << reference.err;
  expect_harmless(reference, "reference");
  for (const char* arguments : {"render 'n\x1b\n.obj' -o a.exr", "compare 'n\x1b\n.exr' a.exr", "'n\x1b\n'",
                                "render tet.obj '--n\x1b\n'", "render tet.obj -o 'n\x1b\n'"}) {
    const Outcome refused = run(arguments);
    EXPECT_NE(refused.code, 0);
    expect_harmless(refused, arguments);
  }
}

/// The bars that were drawn one over the other.
std::vector<std::string> bars(const std::string& shown) {
  std::vector<std::string> all;
  for (std::size_t begin = 0; begin < shown.size();) {
    const std::size_t end = std::min(shown.find('\r', begin), shown.size());
    std::string bar = shown.substr(begin, end - begin);
    if (const std::size_t escape = bar.find("\033[K"); escape != std::string::npos) bar.erase(escape, 3);
    if (!bar.empty() && bar != "\n") all.push_back(bar);
    begin = end + 1;
  }
  return all;
}

TEST_F(TerminalTest, TheBarKeepsItsRow) {
  compile();
  // A limit of a year makes the time left long.
  const std::string line = std::string("'" PARIAN_BINARY "' ") + test::small_render +
                           "--error 0 --frames 100000000 --time 31000000 -o a.exr";
  struct Window {
    unsigned short columns;
    const char* environment;
    std::size_t row;
  };
  for (const auto& [columns, environment, row] : {Window{80, "", 79},
                                                  {200, "", 199},
                                                  {60, "COLUMNS=200 ", 59},
                                                  {24, "", 23},
                                                  {2, "", 1},
                                                  {0, "COLUMNS=33 ", 32},
                                                  {0, "", 79}}) {
    OnTerminal run(scratch_.folder(), fmt::format("exec env -u COLUMNS {}{}", environment, line), columns);
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(run.wait_for("\033[K")) << run.shown();
    run.send(SIGINT);
    EXPECT_EQ(run.finish(), 130) << run.shown();
    const std::vector<std::string> drawn = bars(run.shown());
    EXPECT_GE(drawn.size(), 3U);
    for (const std::string& bar : drawn) EXPECT_LE(bar.size(), row) << columns << ' ' << environment << bar;
    if (row > 80) {
      EXPECT_NE(drawn.front().find("left"), std::string::npos) << drawn.front();
    }
  }
}

}  // namespace
}  // namespace parian
