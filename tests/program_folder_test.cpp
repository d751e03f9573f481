// Where the command keeps compiled programs: by the environment, the driver, and whose folder it is.
#include "session/program_folder.hpp"

#include <cstdlib>
#include <initializer_list>
#include <map>
#include <optional>
#include <utility>

#include "test_command.hpp"

namespace parian::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* intel = "Intel(R) OpenCL";
constexpr const char* pocl = "Portable Computing Language";

/// Variables of the environment as they are to be for a while; nullptr unsets.
class Environment {
 public:
  Environment(std::initializer_list<std::pair<const char*, const char*>> values) {
    for (const auto& [name, value] : values) {
      const char* before = std::getenv(name);
      before_[name] = before ? std::optional<std::string>(before) : std::nullopt;
      set(name, value);
    }
  }
  ~Environment() {
    for (const auto& [name, value] : before_) set(name, value ? value->c_str() : nullptr);
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  static void set(const std::string& name, const char* value) {
    if (value)
      setenv(name.c_str(), value, 1);
    else
      unsetenv(name.c_str());
  }
  std::map<std::string, std::optional<std::string>> before_;
};

TEST(ProgramFolder, IsTheUsersForDriversThatKeepNone) {
  const Scratch scratch;
  const std::string caches = scratch / "caches", home = scratch / "home";
  {
    const Environment set{{"PARIAN_CACHE", nullptr}, {"XDG_CACHE_HOME", caches.c_str()}, {"HOME", home.c_str()}};
    EXPECT_EQ(program_folder(pocl).path, "");
    EXPECT_EQ(program_folder("rusticl").path, "");
    EXPECT_EQ(program_folder(intel).path, caches + "/parian/programs");
    EXPECT_TRUE(fs::is_directory(caches + "/parian/programs"));
    EXPECT_FALSE(fs::exists(home));
  }
  {
    const Environment set{{"PARIAN_CACHE", ""}, {"XDG_CACHE_HOME", "relative"}, {"HOME", home.c_str()}};
    EXPECT_EQ(program_folder(intel).path, home + "/.cache/parian/programs");
  }
  const Environment set{{"PARIAN_CACHE", nullptr}, {"XDG_CACHE_HOME", nullptr}, {"HOME", nullptr}};
  EXPECT_EQ(program_folder(intel).path, "");
}

TEST(ProgramFolder, IsTheOneThatIsNamed) {
  const Scratch scratch;
  const std::string named = scratch / "named";
  {
    const Environment set{{"PARIAN_CACHE", "0"}};
    EXPECT_EQ(program_folder(intel).path, "");
    EXPECT_EQ(program_folder(intel).doubt, "");
  }
  const Environment set{{"PARIAN_CACHE", named.c_str()}};
  EXPECT_EQ(program_folder(pocl).path, named);
  EXPECT_EQ(program_folder(intel).path, named);
}

TEST(ProgramFolder, OfOthersIsLeftAlone) {
  const Scratch scratch;
  const std::string caches = scratch / "caches", open = caches + "/parian/programs";
  fs::create_directories(open);
  fs::permissions(open, fs::perms(0755));
  {
    const Environment set{{"PARIAN_CACHE", nullptr}, {"XDG_CACHE_HOME", caches.c_str()}};
    EXPECT_EQ(program_folder(intel).path, "");
    EXPECT_EQ(program_folder(intel).doubt, "") << "nobody has asked for it";
  }
  const Environment set{{"PARIAN_CACHE", open.c_str()}};
  EXPECT_EQ(program_folder(intel).path, "");
  EXPECT_NE(program_folder(intel).doubt.find("0700"), std::string::npos) << program_folder(intel).doubt;
}

using ProgramFolderCommand = CommandTest;

TEST_F(ProgramFolderCommand, ChangesNoPicture) {
  const auto picture = [&](const std::string& cache, const std::string& says) {
    const Outcome outcome =
        run(std::string(small_render) + "--error 0 --frames 2 -o a.exr --quiet", "PARIAN_CACHE=" + cache);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.err.find(says), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.err.empty(), says.empty()) << outcome.err;
    return read_bytes(scratch_ / "a.exr");
  };
  const std::string without = picture("0", "");
  EXPECT_EQ(picture("kept", ""), without) << "a new folder";
  EXPECT_FALSE(fs::is_empty(scratch_ / "kept"));
  EXPECT_EQ(picture("kept", ""), without) << "a program from it";
  for (const auto& file : fs::directory_iterator(scratch_ / "kept")) fs::resize_file(file.path(), 1000);
  EXPECT_EQ(picture("kept", ""), without) << "damaged ones in it";
  fs::permissions(scratch_ / "kept", fs::perms(0777));
  EXPECT_EQ(picture("kept", "warning: PARIAN_CACHE: "), without) << "others may write it";
}

}  // namespace
}  // namespace parian::test
