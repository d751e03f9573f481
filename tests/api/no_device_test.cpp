// Where there is no device, parian_create says why, in one line, and neither prints nor changes the environment. Each
// case is a process of its own: OpenCL's loader looks for drivers once.
#include <gtest/gtest.h>
#include <parian/parian.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include "scratch.hpp"

namespace parian::test {
namespace {

/// What the command sets for PoCL; drivers themselves set others.
std::string environment() {
  std::string all;
  for (const char* name : {"POCL_CACHE_DIR", "HWLOC_SYNTHETIC", "OCL_ICD_VENDORS"})
    if (const char* value = std::getenv(name)) all.append(name).append("=").append(value).append("\n");
  return all;
}

// The child: what the library says, on standard output.
TEST(DISABLED_NoDeviceChild, Creates) {
  parian_create_info info{};
  info.struct_size = sizeof info;
  const std::string before = environment();
  parian_renderer* renderer = nullptr;
  const parian_status status = parian_create(&info, &renderer);
  std::printf("<%d %s %s>\n", static_cast<int>(status), environment() == before ? "same" : "changed", parian_message());
  parian_release(renderer);
}

/// What parian_create says in a process with these settings, in a folder of its own; and all that is printed beside.
class NoDeviceApi : public testing::Test {
 protected:
  std::string said(const std::string& settings, std::string* printed = nullptr) const {
    const std::string line = "cd '" + scratch_.folder().string() +
                             "' && env -u OCL_ICD_FILENAMES -u OPENCL_VENDOR_PATH OCL_ICD_VENDORS=pocl.icd env " +
                             settings + " '" + std::filesystem::read_symlink("/proc/self/exe").string() +
                             "' --gtest_also_run_disabled_tests --gtest_filter=DISABLED_NoDeviceChild.Creates 2>&1";
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(popen(line.c_str(), "r"), &pclose);
    std::string text;
    for (int c = 0; (c = std::fgetc(pipe.get())) != EOF;) text += static_cast<char>(c);
    const std::size_t begin = text.find('<'), end = text.find(">\n");
    if (begin == std::string::npos || end == std::string::npos) return "nothing: " + text;
    if (printed) *printed = text;
    return text.substr(begin + 1, end - begin - 1);
  }

  void expect(const std::string& settings, const std::string& says) const {
    std::string printed;
    const std::string found = said(settings, &printed);
    const std::string begin = std::to_string(PARIAN_DEVICE_FAILED) + " same ";
    EXPECT_EQ(found.substr(0, begin.size()), begin) << found;
    EXPECT_NE(found.find(says), std::string::npos) << found;
    EXPECT_EQ(found.find('\n'), std::string::npos) << found;
    EXPECT_EQ(found.find("--"), std::string::npos) << found;
    EXPECT_EQ(printed.find("parian: "), std::string::npos) << printed;
  }

  Scratch scratch_;
};

TEST_F(NoDeviceApi, TellsTheCause) {
  expect("OCL_ICD_VENDORS=/nowhere", "there is no OpenCL device: OCL_ICD_VENDORS is '/nowhere', and there is no such");
  expect("OCL_ICD_VENDORS=libnothere.so.1", "libnothere.so.1, which OCL_ICD_VENDORS names, doesn't load (libnothere");
  if (!std::filesystem::exists("/etc/OpenCL/vendors/pocl.icd")) GTEST_SKIP() << "PoCL isn't installed";
  expect("POCL_CACHE_DIR=/proc/x", "PoCL can't keep compiled kernels in /proc/x (POCL_CACHE_DIR): ");
  expect("-u POCL_CACHE_DIR -u XDG_CACHE_HOME HOME=/proc", "PoCL can't keep compiled kernels in /proc/.cache/pocl/kc");
  expect("POCL_CACHE_DIR=", "PoCL would abort, as POCL_CACHE_DIR is set to nothing; unset it, or name a folder");
  scratch_.write("file", "");
  expect("POCL_CACHE_DIR=\"$PWD/file\"", "file is no folder; set POCL_CACHE_DIR to a folder that can be written");
  const std::string bare = "unshare -m sh -c 'mount -t tmpfs none /sys && exec \"$0\" \"$@\"'";
  if (std::system((bare + " true 2>/dev/null").c_str()) != 0) GTEST_SKIP() << "no mounts here";
  expect("-u HWLOC_SYNTHETIC POCL_CACHE_DIR=\"$PWD/cache\" " + bare, "PoCL would abort, as sysfs");
}

}  // namespace
}  // namespace parian::test
