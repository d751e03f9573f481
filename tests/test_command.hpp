// The tool as a user runs it: through the shell, in a folder of its own.
#pragma once
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "scratch.hpp"

namespace parian::test {

struct Outcome {
  int code = -1;
  std::string out, err;
};

class CommandTest : public testing::Test {
 protected:
  CommandTest() { scratch_.write("tet.obj", tetrahedron); }

  /// Runs the tool in the scratch folder; `arguments` go through the shell.
  [[nodiscard]] Outcome run(const std::string& arguments, const std::string& before = "") const {
    return run_shell(before + " '" PARIAN_BINARY "' " + arguments + " >out.txt 2>err.txt </dev/null");
  }

  /// Runs a line of the shell in the scratch folder; what it writes to out.txt and err.txt is the outcome's.
  [[nodiscard]] Outcome run_shell(const std::string& line) const {
    for (const char* name : {"out.txt", "err.txt"}) std::filesystem::remove(scratch_ / name);
    const int status = std::system(("cd '" + scratch_.folder().string() + "' && " + line).c_str());
    Outcome outcome;
    if (WIFEXITED(status)) outcome.code = WEXITSTATUS(status);
    outcome.out = read_bytes(scratch_ / "out.txt");
    outcome.err = read_bytes(scratch_ / "err.txt");
    return outcome;
  }

  /// A refusal with one line that says so, and nothing else.
  void expect_error(const std::string& arguments, int code, const std::string& says) const {
    const Outcome outcome = run(arguments);
    expect_one_line(outcome, code, says, arguments);
    EXPECT_EQ(outcome.out, "") << arguments;
  }

  static void expect_one_line(const Outcome& outcome, int code, const std::string& says, const std::string& of) {
    EXPECT_EQ(outcome.code, code) << of << '\n' << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with("parian: ")) << of << '\n' << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << of << '\n' << outcome.err;
    EXPECT_NE(outcome.err.find(says), std::string::npos) << of << '\n' << outcome.err;
  }

  Scratch scratch_;
};

/// A render that takes a moment, less its outputs.
inline const char* const small_render = "render '" PARIAN_MESHES "/torus.ply' --size 40x40 --layers 6 --layer-size 48 ";

}  // namespace parian::test
