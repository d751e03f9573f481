// Where outputs go: over nothing that is read or written already, through links, and under names that can be had.
#include <fmt/format.h>
#include <unistd.h>

#include <climits>

#include "core/error.hpp"
#include "io/whole_file.hpp"
#include "test_command.hpp"

namespace parian {
namespace {

using test::read_bytes;

class OutputsTest : public test::CommandTest {
 protected:
  OutputsTest() {
    scratch_.write("s.toml", "[[object]]\nmesh = \"tet.obj\"\n");
    scratch_.write("c.toml", "[[camera]]\n[[camera]]\n");
    scratch_.write("truth.exr", "not read before it is known that nothing is lost");
    std::filesystem::create_symlink("tet.obj", scratch_ / "mesh.exr");
    std::filesystem::create_symlink("later.exr", scratch_ / "link.exr");  // its target isn't there yet
    std::filesystem::create_symlink("s.toml", scratch_ / "page.json");
    std::filesystem::create_hard_link(scratch_ / "tet.obj", scratch_ / "twin.obj");
  }

  /// Refused before a device is looked for.
  void expect_refused(const std::string& arguments, const std::string& says) const {
    const auto outcome = run(arguments, "PARIAN_DEVICE='no such device'");
    expect_one_line(outcome, 2, says, arguments);
    EXPECT_NE(outcome.err.find("are the same file"), std::string::npos) << outcome.err;
  }
};

TEST_F(OutputsTest, NoneReplacesAnInputOrAnother) {
  const std::string scene = read_bytes(scratch_ / "s.toml"), mesh = read_bytes(scratch_ / "tet.obj");
  expect_refused("render s.toml -o a.exr --stats s.toml", "--stats");
  expect_refused("render s.toml -o a.exr --stats ../\"${PWD##*/}\"/tet.obj", "the mesh");
  expect_refused("render s.toml -o a.exr --stats twin.obj", "the mesh");
  expect_refused("render s.toml -o mesh.exr", "-o");
  expect_refused("render tet.obj -o mesh.exr", "-o");
  expect_refused("render s.toml --dry-run --stats page.json", "the scene");
  expect_refused("render tet.obj -o v_%d.exr --cameras c.toml --stats ./c.toml", "--cameras");
  expect_refused("render tet.obj -o a.exr -o ./a.exr", "another -o");
  expect_refused("render tet.obj -o later.exr -o link.exr", "another -o");
  expect_refused("render tet.obj -o v_%d.exr -o ./v_%d.exr --cameras c.toml", "v_0.exr");
  expect_refused("render tet.obj -o a.exr --stats a.exr", "--stats");
  expect_refused("render s.toml -o a.exr --stats out.txt", "standard output");
  expect_refused("render s.toml -o a.exr --stats \"$PWD/err.txt\"", "standard error");
  expect_refused("reference s.toml -o mesh.exr", "the mesh");
  expect_refused("reference tet.obj -o a.exr -o \"$PWD/a.exr\"", "another -o");
  expect_refused("compare truth.exr tet.obj --difference ./truth.exr", "the picture");
  expect_refused("compare tet.obj truth.exr --difference truth.exr", "the reference");
  expect_refused("report s.toml -o page.html", "the scene");
  EXPECT_EQ(read_bytes(scratch_ / "s.toml"), scene);
  EXPECT_EQ(read_bytes(scratch_ / "tet.obj"), mesh);
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "a.exr"));
}

TEST_F(OutputsTest, WhereResultsAreAppendedIsAnOutputToo) {
  scratch_.write("v.json", "{}");
  const std::string device = "PARIAN_DEVICE='no such device' '" PARIAN_BINARY "' ";
  for (const char* line : {"render s.toml -o a.exr >>s.toml", "bench tet.obj >>tet.obj",
                           "check --vectors v.json >>v.json", "compare truth.exr mesh.exr --json >>truth.exr"})
    expect_one_line(run_shell(device + line + " 2>err.txt"), 2, "standard output", line);
}

TEST_F(OutputsTest, ALinkIsWrittenThrough) {
  std::filesystem::create_directory(scratch_ / "sub");
  std::filesystem::create_symlink("sub/middle.json", scratch_ / "link.json");
  std::filesystem::create_symlink(scratch_ / "sub/real.json", scratch_ / "sub/middle.json");
  for (const char* text : {"first", "second"}) {  // the target isn't there, then it is
    write_text(scratch_ / "link.json", text);
    EXPECT_TRUE(std::filesystem::is_symlink(scratch_ / "link.json"));
    EXPECT_TRUE(std::filesystem::is_symlink(scratch_ / "sub/middle.json"));
    EXPECT_FALSE(std::filesystem::is_symlink(scratch_ / "sub/real.json"));
    EXPECT_EQ(read_bytes(scratch_ / "sub/real.json"), text);
  }
  std::filesystem::create_symlink("none/real.exr", scratch_ / "lost.exr");
  expect_error("render none.obj -o lost.exr", 5, "there is no folder");
  std::filesystem::create_symlink("b.exr", scratch_ / "c.exr");
  std::filesystem::create_symlink("c.exr", scratch_ / "b.exr");
  expect_error("render none.obj -o b.exr", 5, "circles");
}

TEST_F(OutputsTest, NamesThatAreTooLongFailFirst) {
  const auto longest = static_cast<std::size_t>(pathconf(scratch_.folder().c_str(), _PC_NAME_MAX));
  const std::string name(longest - 4, 'n');
  expect_error(fmt::format("render none.obj -o {}n.exr", name), 5, "too long");
  expect_error(fmt::format("render none.obj -o a.exr --stats {}n.jsn", name), 5, "too long");
  expect_error(fmt::format("reference none.obj -o {}n.exr", name), 5, "too long");
  expect_error(fmt::format("report none.obj -o {}.html", name), 5, "too long");
  expect_error(fmt::format("render tet.obj -o v{}%d.exr --cameras ten.toml", name.substr(2)), 3, "ten.toml");
  std::string eleven;
  for (int i = 0; i < 11; ++i) eleven += "[[camera]]\n";
  scratch_.write("ten.toml", eleven);
  expect_error(fmt::format("render tet.obj -o v{}%d.exr --cameras ten.toml", name.substr(2)), 5,
               "too long");  // the last only
  std::string folder = scratch_.folder().string();
  constexpr std::size_t longest_folder = PATH_MAX - 12;
  while (folder.size() < longest_folder) {
    const std::size_t left = longest_folder - folder.size() - 1;
    folder += '/';
    folder.append(left > 202 ? 200 : left, 'f');
    std::filesystem::create_directory(folder);
  }
  EXPECT_THROW(check_place(folder + "/d.exr"), Error);  // fits, but what is written beside it first doesn't
  // What fits is written, however its letters are divided.
  for (const std::string& whole : {fmt::format("{}.exr", name), fmt::format("n.{}nn", name)}) {
    write_text(scratch_ / whole, "text");
    EXPECT_EQ(read_bytes(scratch_ / whole), "text");
  }
}

}  // namespace
}  // namespace parian
