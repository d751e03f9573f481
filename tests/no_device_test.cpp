// Where there is no device, or a driver ends the process: one line says which driver it is, what is wrong with it, and
// what helps; each cause has its own.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <map>
#include <nlohmann/json.hpp>

#include "test_command.hpp"
#include "test_device.hpp"

namespace parian::test {
namespace {

namespace fs = std::filesystem;

/// Whether a line of the shell succeeds.
bool can(const std::string& line) { return std::system(("{ " + line + "; } >/dev/null 2>&1").c_str()) == 0; }

class NoDevice : public CommandTest {
 protected:
  NoDevice() { fs::create_directory(scratch_ / "vendors"); }

  /// Registers a library in the folder that run_with() names, alone.
  void only(const std::string& library) const {
    fs::remove_all(scratch_ / "vendors");
    fs::create_directory(scratch_ / "vendors");
    scratch_.write("vendors/one.icd", library + "\n");
  }

  /// Runs the tool in an environment of these settings over one that has no device; `through` runs it.
  [[nodiscard]] Outcome run_with(const std::string& settings, const std::string& arguments,
                                 const std::string& through = "") const {
    return run(arguments,
               "env -u PARIAN_DEVICE -u OCL_ICD_FILENAMES -u OPENCL_VENDOR_PATH OCL_ICD_VENDORS=\"$PWD/vendors\" env " +
                   settings + " " + through);
  }

  /// No device, by each command that needs one: a line with all these words.
  void expect_no_device(const std::string& settings, const std::vector<std::string>& says,
                        const std::vector<std::string>& commands = {"devices"}, const std::string& through = "") const {
    for (const std::string& command : commands) {
      const Outcome outcome = run_with(settings, command, through);
      expect_one_line(outcome, 4, "there is no OpenCL device: ", command);
      for (const std::string& words : says) EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
      EXPECT_EQ(outcome.out, "");
    }
  }

  const std::vector<std::string> all_commands_{"devices", "check", "render tet.obj -o a.exr", "bench tet.obj",
                                               "render tet.obj --dry-run"};
};

TEST_F(NoDevice, NothingIsRegistered) {
  const std::string usual = "/etc/OpenCL/vendors",
                    remedy = can("ls " + usual + "/*.icd") ? "has " : "install your GPU's driver, or PoCL";
  const std::string folder = (scratch_ / "vendors").string();
  expect_no_device("", {"no driver is registered in " + folder + " (OCL_ICD_VENDORS), which has no .icd file", remedy},
                   all_commands_);
  expect_no_device("OCL_ICD_VENDORS=/nowhere", {"OCL_ICD_VENDORS is '/nowhere', and there is no such", remedy});
  expect_no_device("OCL_ICD_VENDORS=none.icd", {"'none.icd', and there is no such file in " + usual, remedy});
  expect_no_device("OCL_ICD_VENDORS= OPENCL_VENDOR_PATH=/nowhere",
                   {"no driver is registered in /nowhere (OPENCL_VENDOR_PATH), which is no folder", remedy});
}

TEST_F(NoDevice, TheUsualFolderIsEmpty) {
  const std::string bare = "unshare -m sh -c 'mount -t tmpfs none /etc/OpenCL/vendors && exec \"$0\" \"$@\"'";
  if (!can(bare + " true")) GTEST_SKIP() << "no mounts here";
  expect_no_device(
      "OCL_ICD_VENDORS=",
      {"no driver is registered in /etc/OpenCL/vendors, which has no .icd file; install your GPU's driver, "
       "or PoCL to run on the CPU (Debian and Ubuntu: apt install pocl-opencl-icd)"},
      {"devices"}, bare);
}

TEST_F(NoDevice, ALibraryDoesNotLoad) {
  only("libnothere.so.1");
  const std::string file = (scratch_ / "vendors/one.icd").string();
  expect_no_device("",
                   {"libnothere.so.1, which " + file + " names, doesn't load (", "cannot open shared object file",
                    "install that driver anew, or remove the file"},
                   all_commands_);
  only("libm.so.6");
  expect_no_device("", {"libm.so.6, which " + file + " names, is no OpenCL driver (it lacks clGetExtension"});
  only("");
  expect_no_device("", {file + " names no driver (it names no library); mend or remove that file"});
  fs::remove(file);
  fs::create_symlink("/nowhere", file);
  expect_no_device("", {file + " names no driver (No such file or directory); mend or remove that file"});
  expect_no_device("OCL_ICD_VENDORS=libnothere.so.1",
                   {"libnothere.so.1, which OCL_ICD_VENDORS names, doesn't load", "mend or unset OCL_ICD_VENDORS"});
}

TEST_F(NoDevice, ADriverFindsNoHardware) {
  only(PARIAN_FAKE_DRIVER);
  expect_no_device("",
                   {"which " + (scratch_ / "vendors/one.icd").string() + " names, finds no hardware of its own",
                    "install your GPU's driver"},
                   all_commands_);
  expect_no_device("PARIAN_FAKE_DRIVER=memory", {"(code -6)", "give this process more memory"});
}

TEST_F(NoDevice, APlatformHasNone) {
  if (!fs::exists("/etc/OpenCL/vendors/rusticl.icd")) GTEST_SKIP() << "rusticl isn't installed";
  if (run_with("-u RUSTICL_ENABLE OCL_ICD_VENDORS=rusticl.icd", "devices").code == 0) GTEST_SKIP() << "rusticl has one";
  expect_no_device("-u RUSTICL_ENABLE OCL_ICD_VENDORS=rusticl.icd",
                   {"the platform rusticl has no device, since RUSTICL_ENABLE isn't set; set RUSTICL_ENABLE to"});
  const Outcome outcome = run_with("-u RUSTICL_ENABLE OCL_ICD_VENDORS=rusticl.icd", "check --device rusticl");
  expect_one_line(outcome, 4, "the platform rusticl has no device", "check");
}

TEST_F(NoDevice, AGpusFilesAreForOthers) {
  const std::string locked =
      "unshare -m sh -c 'mount -t tmpfs none /dev && mkdir /dev/dri && : >/dev/dri/renderD128 && chmod 600 "
      "/dev/dri/renderD128 && exec setpriv --reuid 12345 --regid 12345 --clear-groups \"$0\" \"$@\"'";
  if (!can(locked + " true")) GTEST_SKIP() << "no mounts, or no other users, here";
  only(PARIAN_FAKE_DRIVER);
  for (const fs::path& path : {scratch_.folder(), scratch_ / "vendors"}) fs::permissions(path, fs::perms::all);
  const Outcome outcome = run_with("", "devices", locked);
  if (outcome.err.find("Permission denied") == std::string::npos && outcome.code != 4)
    GTEST_SKIP() << "other users can't run the tool here";
  expect_one_line(outcome, 4, "a GPU's /dev/dri/renderD128 can't be opened (Permission denied)", "devices");
  EXPECT_NE(outcome.err.find("become a member of its group, 'root'"), std::string::npos) << outcome.err;
}

TEST_F(NoDevice, OthersAreRemarkedOnWhereThereIsOne) {
  if (run("devices").code != 0) GTEST_SKIP() << "there is none";
  const std::string pocl = "/etc/OpenCL/vendors/pocl.icd";
  if (!fs::exists(pocl)) GTEST_SKIP() << "PoCL isn't installed";
  only("libnothere.so.1");
  fs::copy_file(pocl, scratch_ / "vendors/pocl.icd");
  const Outcome devices = run_with("", "devices --json"), dry = run_with("", "render tet.obj --dry-run --quiet");
  EXPECT_EQ(nlohmann::json::parse(devices.out).size(), 1U);
  expect_one_line(devices, 0, "libnothere.so.1, which", "devices");
  EXPECT_EQ(dry.code, 0);
  EXPECT_EQ(dry.err, "");
  expect_one_line(run_with("", "check --device NotHere"), 4, "device 'NotHere': libnothere.so.1, which", "check");
  expect_one_line(run_with("", "check --device elsewhere"), 4, "device 'elsewhere': no such OpenCL device", "check");
}

TEST_F(NoDevice, ADriverEndsTheProcess) {
  only(PARIAN_FAKE_DRIVER);
  for (const char* way : {"crash", "exit"}) {
    const std::string settings = std::string("PARIAN_FAKE_DRIVER=") + way;
    const Outcome devices = run_with(settings, "devices"), render = run_with(settings, "render tet.obj -o a.exr");
    expect_one_line(devices, 4, "one.icd names, fails when it is asked for its devices: ", settings);
    expect_one_line(render, 4, "update the driver, or choose another device with --device", settings);
  }
}

/// PoCL alone, with a cache of its own in the scratch folder.
class NoCache : public NoDevice {
 protected:
  void SetUp() override {
    if (!fs::exists("/etc/OpenCL/vendors/pocl.icd")) GTEST_SKIP() << "PoCL isn't installed";
  }
  const std::string pocl_ = "-u XDG_CACHE_HOME -u XDG_RUNTIME_DIR -u POCL_CACHE_DIR OCL_ICD_VENDORS=pocl.icd ",
                    cached_ = pocl_ + "POCL_CACHE_DIR=\"$PWD/cache\" ";
};

TEST_F(NoCache, WhatTheUserChoseCannotBeWritten) {
  const std::string remedy = "; set POCL_CACHE_DIR to a folder that can be written";
  expect_no_device(pocl_ + "POCL_CACHE_DIR=/proc/x",
                   {"PoCL can't keep compiled kernels in /proc/x (POCL_CACHE_DIR): ", remedy},
                   {"devices", "check", "render tet.obj -o a.exr"});
  scratch_.write("file", "");
  const Outcome outcome = run_with(pocl_ + "POCL_CACHE_DIR=\"$PWD/file\"", "render tet.obj -o a.exr");
  expect_one_line(outcome, 4, "file is no folder" + remedy, "a file in place of the folder");
  const Outcome empty = run_with(pocl_ + "POCL_CACHE_DIR=", "render tet.obj --dry-run --quiet");
  EXPECT_EQ(empty.code, 0) << empty.err;
}

TEST_F(NoCache, ItsFileSystemIsOfNoUse) {
  fs::create_directory(scratch_ / "disk");
  for (const auto& [options, says] : {std::pair("ro", "Read-only file system"),
                                      {"noexec", "it is mounted noexec"},
                                      {"size=100k", "less than 8 MB are free there"}}) {
    const std::string mounted =
        std::string("unshare -m sh -c 'mount -t tmpfs -o ") + options + " none disk && exec \"$0\" \"$@\"'";
    if (!can("cd '" + scratch_.folder().string() + "' && " + mounted + " true")) GTEST_SKIP() << "no mounts here";
    const Outcome outcome = run_with(pocl_ + "POCL_CACHE_DIR=\"$PWD/disk\"", "check", mounted);
    expect_one_line(outcome, 4, says, options);
    const Outcome home = run_with(pocl_ + "HOME=\"$PWD/disk\" TMPDIR=\"$PWD\"", "render tet.obj --dry-run", mounted);
    EXPECT_EQ(home.code, 0) << home.err;
  }
}

TEST_F(NoCache, PoclGetsOneOfTheUsersOwn) {
  const std::string settings = pocl_ + "HOME=/proc TMPDIR=\"$PWD/tmp\"";
  const fs::path folder = scratch_ / ("tmp/parian-" + std::to_string(geteuid()));
  fs::create_directories(scratch_ / "tmp");
  fs::create_directories(scratch_ / "else");
  const auto refused = [&](const std::string& what) {
    expect_no_device(settings, {"PoCL can't keep compiled kernels in /proc/.cache/pocl/kcache (HOME): "});
    EXPECT_TRUE(fs::is_empty(scratch_ / "else")) << what;
  };
  fs::create_directory_symlink(scratch_ / "else", folder);
  refused("a link");
  fs::remove(folder);
  fs::create_directory(folder);
  fs::permissions(folder, fs::perms::all);
  refused("a folder that others can write");
  if (geteuid() == 0) {
    fs::permissions(folder, fs::perms::owner_all);
    ASSERT_EQ(chown(folder.c_str(), 12345, 12345), 0);
    refused("another's folder");
  }
  fs::remove_all(folder);

  const Outcome outcome = run_with(settings, "render tet.obj --dry-run --quiet");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.err, "");
  struct stat status {};
  ASSERT_EQ(stat(folder.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0700U);
  EXPECT_TRUE(fs::is_directory(folder / "pocl"));
}

TEST_F(NoCache, DamagedKernelsAreNamed) {
  const fs::path cache = scratch_ / "cache";
  for (const char* command : {"devices", "render tet.obj --dry-run"}) ASSERT_EQ(run_with(cached_, command).code, 0);
  const auto expect_named = [&](const std::string& name, const std::string& damage) {
    std::map<fs::path, std::string> whole;  // of the programs of the commands
    for (const fs::path& file : fs::recursive_directory_iterator(cache))
      if (file.filename() == name) whole[file] = read_bytes(file);
    ASSERT_FALSE(whole.empty());
    for (const auto& [file, content] : whole) {
      std::string bytes = content;
      if (damage == "cut") bytes.resize(bytes.size() / 2);
      if (damage == "empty") bytes.clear();
      if (damage == "zeros") bytes.assign(bytes.size(), '\0');
      if (damage == "zeros at the end") std::fill(bytes.begin() + std::ptrdiff_t(bytes.size() / 2), bytes.end(), '\0');
      std::ofstream(file, std::ios::binary) << bytes;
    }
    const Outcome outcome = run_with(cached_, "render tet.obj -o a.exr --size 16x16 --frames 1");
    const std::string what = name + ": " + damage + "\n" + outcome.err;
    EXPECT_EQ(outcome.code, 4) << what;
    const std::size_t last = outcome.err.rfind('\n', outcome.err.size() - 2) + 1;  // after what PoCL says
    EXPECT_EQ(outcome.err.compare(last, 8, "parian: "), 0) << what;
    EXPECT_NE(outcome.err.find(cache.string() + ", which may be damaged", last), std::string::npos) << what;
    if (damage == "cut") {
      const auto list = nlohmann::json::parse(run_with(cached_, "devices --json").out);
      const std::string found = list[0]["self_test"]["failed"].dump();
      EXPECT_NE(found.find("delete its compiled kernels, " + cache.string()), std::string::npos) << found;
    }
    for (const auto& [file, content] : whole) std::ofstream(file, std::ios::binary) << content;
  };
  expect_named("program.bc", "cut");
  expect_named("self_test.so", "cut");
  if (!deep()) return;
  for (const char* damage : {"empty", "zeros"}) expect_named("program.bc", damage);
  for (const char* damage : {"empty", "zeros", "zeros at the end"}) expect_named("self_test.so", damage);
}

TEST_F(NoCache, SysfsIsNotMounted) {
  const std::string bare = "unshare -m sh -c 'mount -t tmpfs none /sys && exec \"$0\" \"$@\"'";
  if (!can(bare + " true")) GTEST_SKIP() << "no mounts here";
  // The last two need no device, but their modules are loaded after the drivers.
  for (const char* command : {"render tet.obj --frames 1 --size 16x16 --error 0 --quiet -o a.exr",
                              "compare a.exr a.exr", "reference tet.obj --size 4x4 --error 0.5 --quiet -o b.exr"}) {
    const Outcome outcome = run_with(cached_ + "env -u HWLOC_SYNTHETIC", command, bare);
    EXPECT_EQ(outcome.code, 0) << command;
    EXPECT_EQ(outcome.err, "") << command;
  }
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__has_feature)
#define PARIAN_LIMITED_MEMORY
#elif !defined(__SANITIZE_ADDRESS__)
#if !__has_feature(address_sanitizer)
#define PARIAN_LIMITED_MEMORY
#endif
#endif
#ifdef PARIAN_LIMITED_MEMORY
TEST_F(NoCache, NorMemory) {
  expect_no_device(cached_, {"doesn't load (", "; raise the limit of this process's memory, 126 MB now (ulimit -v)"},
                   {"devices", "check", "render tet.obj -o a.exr"}, "sh -c 'ulimit -v 130000 && exec \"$0\" \"$@\"'");
}
#endif

}  // namespace
}  // namespace parian::test
