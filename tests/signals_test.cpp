// Signals and time limits end long work early, with what there is by then.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "io/image_file.hpp"
#include "test_command.hpp"
#include "test_terminal.hpp"

namespace parian {
namespace {

using test::OnTerminal;
using test::read_bytes;

const std::string tool = "exec '" PARIAN_BINARY "' ";
const std::string endless = tool + test::small_render + "--error 0 --frames 100000000 -o a.exr --stats s.json";

class SignalsTest : public test::CommandTest {
 protected:
  [[nodiscard]] std::string stopped_by() const {
    return nlohmann::json::parse(read_bytes(scratch_ / "s.json"))["stopped_by"];
  }
  [[nodiscard]] int batches(const std::string& name) const {
    return std::stoi(read_notes(scratch_ / name).at("batches"));
  }
};

TEST_F(SignalsTest, EachEndsARenderWithItsPicture) {
  for (const auto& [signal, code] : {std::pair{SIGINT, 130}, {SIGTERM, 143}, {SIGHUP, 129}}) {
    OnTerminal run(scratch_.folder(), endless);
    ASSERT_TRUE(run.wait_for("frame ")) << run.shown();
    run.send(signal);
    EXPECT_EQ(run.finish(), code) << run.shown();
    EXPECT_EQ(read_image(scratch_ / "a.exr").width, 40U);
    EXPECT_EQ(stopped_by(), "interrupt");
    for (const char* name : {"a.exr", "s.json"}) std::filesystem::remove(scratch_ / name);
  }
}

TEST_F(SignalsTest, WhatTheParentIgnoresStaysIgnored) {
  for (const auto& [name, signal] : {std::pair{"HUP", SIGHUP}, {"INT", SIGINT}}) {
    OnTerminal run(scratch_.folder(), fmt::format("trap '' {} && {}", name, endless));
    ASSERT_TRUE(run.wait_for("frame ")) << run.shown();
    run.send(signal);
    EXPECT_TRUE(run.wait_for("frame ") && run.wait_for("frame ")) << name << '\n' << run.shown();
    run.send(SIGTERM);
    EXPECT_EQ(run.finish(), 143) << name << '\n' << run.shown();
  }
}

TEST_F(SignalsTest, TheReferenceEndsInTimeWithWhatItHas) {
  // Sixteen batches of this film, which a target needs, take far longer.
  const auto outcome = run("reference tet.obj --size 512x512 --error 0 --time 0.001 -o a.exr");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(batches("a.exr"), 2);
  EXPECT_FALSE(read_image(scratch_ / "a.exr").standard_error.empty());
  EXPECT_NE(outcome.err.find("2 batches are few for a standard error; add --resume"), std::string::npos) << outcome.err;
  const std::string before = read_bytes(scratch_ / "a.exr");
  EXPECT_EQ(run("reference tet.obj --size 512x512 --error 0 --time 0.001 --resume -o a.exr").code, 0);
  EXPECT_TRUE(read_bytes(scratch_ / "a.exr") == before);  // no time for a batch more
}

TEST_F(SignalsTest, EndTheReferenceWithWhatItHas) {
  OnTerminal run(scratch_.folder(), tool + "reference tet.obj --size 64x64 --error 0 -o a.exr");
  ASSERT_TRUE(run.wait_for("batch ")) << run.shown();
  run.send(SIGTERM);
  EXPECT_EQ(run.finish(), 143) << run.shown();
  EXPECT_GE(batches("a.exr"), 2);
  EXPECT_FALSE(read_image(scratch_ / "a.exr").standard_error.empty());
}

TEST_F(SignalsTest, AReportWithoutAWholeSeedIsNotWritten) {
  OnTerminal run(scratch_.folder(), tool + "report tet.obj --size 16x16 -o page.html");
  ASSERT_TRUE(run.wait_for("batch of the reference ") || run.wait_for("limit 1 of")) << run.shown();
  run.send(SIGTERM);
  EXPECT_EQ(run.finish(), 143) << run.shown();
  EXPECT_NE(run.shown().find("nothing is written"), std::string::npos) << run.shown();
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "page.html"));
}

TEST_F(SignalsTest, HelpSaysWhatEachCommandDoes) {
  for (const char* command : {"", "render", "reference", "report"}) {
    const std::string help = run(std::string(command) + " --help").out;
    for (const char* word : {"SIGTERM", "SIGHUP", "143", "129"})
      EXPECT_NE(help.find(word), std::string::npos) << command << ' ' << word;
  }
}

}  // namespace
}  // namespace parian
