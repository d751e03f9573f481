// tools/scaling, as far as a quick run tells: it measures, fits and draws.
#include <gtest/gtest.h>

#include <cstdlib>
#include <sstream>

#include "scratch.hpp"
#include "xml.hpp"

namespace parian {
namespace {

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) ++n;
  return n;
}

TEST(Scaling, QuickRun) {
  const test::Scratch scratch;
  const std::string folder = scratch.folder().string();
  const std::string command = "PARIAN='" PARIAN_BINARY "' '" PARIAN_MESHES
                              "/../tools/scaling' --quick --axis triangles "
                              "--axis lights --axis threads -o '" +
                              folder + "/scaling.svg' >'" + folder + "/table.txt' 2>'" + folder + "/progress.txt'";
  ASSERT_EQ(std::system(command.c_str()), 0) << test::read_bytes(scratch / "progress.txt");

  std::istringstream table(test::read_bytes(scratch / "table.txt"));
  std::string line;
  std::getline(table, line);
  EXPECT_NE(line.find("exponent"), std::string::npos) << line;
  // A model of 4608 triangles with each edge in two parts; two values that no exponent's interval follows from.
  for (const char* largest : {"18.4k", " 2 ", " 2 "}) {
    ASSERT_TRUE(std::getline(table, line));
    EXPECT_NE(line.find(largest), std::string::npos) << line;
    EXPECT_NE(line.find(" GB"), std::string::npos) << line;
  }
  EXPECT_FALSE(std::getline(table, line)) << line;

  const std::string svg = test::read_bytes(scratch / "scaling.svg");
  EXPECT_EQ(test::xml_problem(svg), "");
  for (const char* word : {">triangles<", ">lights, which share 128 samples<", ">threads<", ">whole run<"})
    EXPECT_EQ(count(svg, word), 1U) << word;
}

}  // namespace
}  // namespace parian
