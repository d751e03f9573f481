// Modules: what they bring is loaded late, after OpenCL's drivers, and one that is missing is named.
#include "test_command.hpp"

namespace parian::test {
namespace {

class Modules : public CommandTest {
 protected:
  /// Runs the tool with a driver that isn't there registered; returns what the loader of libraries was asked for.
  [[nodiscard]] std::string loaded_by(const std::string& arguments) const {
    std::filesystem::create_directory(scratch_ / "vendors");
    scratch_.write("vendors/none.icd", "libparian-no-driver.so\n");
    (void)run(arguments, "OCL_ICD_VENDORS=\"$PWD/vendors\" LD_DEBUG=libs LD_DEBUG_OUTPUT=loader");
    std::string all;
    for (const auto& file : std::filesystem::directory_iterator(scratch_.folder()))
      if (file.path().filename().string().starts_with("loader.")) {
        all += read_bytes(file.path());
        std::filesystem::remove(file.path());
      }
    return all;
  }
};

constexpr std::size_t never = std::string::npos;

// Of two versions of TBB the first that is loaded is a process's only one; drivers may need the newer one.
TEST_F(Modules, AreLoadedAfterDrivers) {
  const std::string plain = loaded_by("materials");
  EXPECT_NE(plain.find("find library=libOpenCL"), never);
  for (const char* late : {"find library=libtbb", "find library=libembree", "find library=libOpenImageIO"})
    EXPECT_EQ(plain.find(late), never) << late;
  const std::string reference = loaded_by("reference tet.obj --size 4x4 --error 1e6 --quiet -o a.exr");
  const std::string compare = loaded_by("compare a.exr a.exr");
  for (const auto& [log, module] :
       {std::pair(&reference, "find library=parian-rays.so"), std::pair(&reference, "find library=parian-pictures.so"),
        std::pair(&compare, "find library=parian-pictures.so")}) {
    const std::size_t driver = log->find("libparian-no-driver.so");
    EXPECT_NE(driver, never) << module;
    EXPECT_NE(log->find(module), never) << module;
    EXPECT_LT(driver, log->find(module)) << module;
    EXPECT_LT(driver, log->find("find library=libtbb")) << module;
  }
}

TEST_F(Modules, ThatAreMissingAreNamed) {
  std::filesystem::copy(PARIAN_BINARY, scratch_ / "alone");
  const auto alone = [&](const std::string& arguments) {
    return run_shell("./alone " + arguments + " >out.txt 2>err.txt </dev/null");
  };
  scratch_.write("a.exr", "nothing");
  for (const auto& [arguments, code, says] :
       {std::tuple("reference tet.obj --size 4x4 -o a.exr", 4, "the reference can't trace rays (parian-rays.so: "),
        std::tuple("compare a.exr a.exr", 5, "pictures can't be read or written (parian-pictures.so: ")})
    expect_one_line(alone(arguments), code, says, arguments);
}

}  // namespace
}  // namespace parian::test
