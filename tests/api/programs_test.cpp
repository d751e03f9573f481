// Compiled programs: shared by renderers of a context, and kept in a folder, from which only what is whole and right is
// believed. And parts of devices, which renderers work on like others.
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "core/program_cache.hpp"
#include "opencl_watch.hpp"
#include "refusals.hpp"
#include "scratch.hpp"
#include "small_scene.hpp"

namespace parian::test {
namespace {

namespace fs = std::filesystem;

/// What a plan's programs, its own and the self-test's, came from.
struct Origin {
  std::uint64_t sources = 0, binaries = 0;
};

/// Plans and renders in a context of its own, with programs kept in `folder`, and expects the right image.
Origin render_with(const fs::path& folder) {
  const cl::Context context(opencl().device);
  const SmallScene scene;
  OpenclWatch watch;
  const Handle r = create(in_context(context));
  EXPECT_EQ(parian_set_cache(r.get(), folder.c_str()), PARIAN_SUCCESS) << parian_message();
  EXPECT_EQ(scene.give(r.get()), PARIAN_SUCCESS) << parian_message();
  EXPECT_EQ(parian_plan(r.get(), nullptr), PARIAN_SUCCESS) << parian_message();
  EXPECT_EQ(read_after(r.get(), 2), right_image());
  return {watch.calls("clCreateProgramWithSource"), watch.calls("clCreateProgramWithBinary")};
}

/// The larger of the folder's two files: the program that renders.
fs::path entry_of(const fs::path& folder) {
  std::vector<fs::path> all;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) all.push_back(entry.path());
  EXPECT_EQ(all.size(), 2U);
  const auto smaller = [](const fs::path& a, const fs::path& b) { return fs::file_size(a) < fs::file_size(b); };
  return all.empty() ? fs::path() : *std::max_element(all.begin(), all.end(), smaller);
}

/// A folder that holds the small scene's programs.
class KeptPrograms : public testing::Test {
 protected:
  KeptPrograms() {
    (void)right_image();
    const Origin first = render_with(folder_);
    EXPECT_EQ(first.sources, 2U);
    EXPECT_EQ(first.binaries, 0U);
    entry_ = entry_of(folder_);
    text_ = read_bytes(entry_);
  }
  void write(const std::string& text) const { std::ofstream(entry_, std::ios::binary) << text; }
  /// The entry as it is now isn't believed, and a good one takes its place.
  void expect_made_anew(const std::string& what) const {
    const Origin origin = render_with(folder_);
    EXPECT_EQ(origin.binaries, 1U) << what;  // the self-test's
    EXPECT_EQ(origin.sources, 1U) << what;
    const Origin next = render_with(folder_);
    EXPECT_EQ(next.binaries, 2U) << what << ": its successor";
    EXPECT_EQ(next.sources, 0U) << what << ": its successor";
  }

  Scratch scratch_;
  fs::path folder_ = scratch_ / "caches/programs", entry_;
  std::string text_;
};

TEST_F(KeptPrograms, AreLoadedInTheNextContext) {
  const Origin next = render_with(folder_);
  EXPECT_EQ(next.sources, 0U);
  EXPECT_EQ(next.binaries, 2U);
  EXPECT_EQ(fs::status(folder_).permissions(), fs::perms::owner_all);
  EXPECT_EQ(fs::status(entry_).permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST_F(KeptPrograms, DamagedOnesAreMadeAnew) {
  expect_made_anew((write(""), "nothing in it"));
  expect_made_anew((write(text_.substr(0, 20)), "cut off in its head"));
  expect_made_anew((write(text_.substr(0, text_.size() - 1)), "its last byte is missing"));
  expect_made_anew((write(text_ + "x"), "longer than it should be"));
  for (const std::size_t at :
       {std::size_t{0}, std::size_t{9}, std::size_t{17}, std::size_t{25}, std::size_t{40}, text_.size() - 1}) {
    std::string flipped = text_;
    flipped[at] = static_cast<char>(flipped[at] ^ 4);
    expect_made_anew((write(flipped), "a bit of byte " + std::to_string(at) + " is another"));
  }
}

TEST_F(KeptPrograms, ThoseOfOthersAreMadeAnew) {
  fs::permissions(entry_, fs::perms::group_write, fs::perm_options::add);
  expect_made_anew("others may write it");
  fs::rename(entry_, scratch_ / "elsewhere");
  fs::create_symlink(scratch_ / "elsewhere", entry_);
  expect_made_anew("a link");
  if (geteuid() == 0) {
    ASSERT_EQ(chown(entry_.c_str(), 65534, 65534), 0);
    expect_made_anew("another user's");
  }
  // What was kept under another key, such as another driver's.
  const ProgramCache cache(folder_);
  std::set<fs::path> before;
  for (const fs::directory_entry& file : fs::directory_iterator(folder_)) before.insert(file.path());
  cache.keep("another key", ProgramCache::Bytes(1000, 'x'));
  for (const fs::directory_entry& file : fs::directory_iterator(folder_))
    if (!before.contains(file.path())) {
      fs::rename(fs::path(file.path()), entry_);
      break;
    }
  EXPECT_FALSE(cache.find("another key"));
  expect_made_anew("another key's");
}

// What a driver refuses to load, or fails to build, is compiled from source, and replaced.
TEST_F(KeptPrograms, RefusedOnesAreMadeAnew) {
  for (const char* refuses : {"clCreateProgramWithBinary", "clBuildProgram"}) {
    const cl::Context context(opencl().device);
    const SmallScene scene;
    std::uint64_t n = 0;
    for (const bool fail : {false, true}) {
      OpenclWatch watch;
      if (fail) watch.fail(n, CL_INVALID_BINARY);
      const Handle r = create(in_context(context));
      CALL(parian_set_cache(r.get(), folder_.c_str()));
      CALL(scene.give(r.get()));
      CALL(parian_plan(r.get(), nullptr));
      EXPECT_EQ(watch.failed(), fail ? refuses : "");
      EXPECT_EQ(watch.calls("clCreateProgramWithSource"), fail ? 1U : 0U);
      const auto& names = watch.names();
      n = static_cast<std::uint64_t>(std::find(names.begin(), names.end(), std::string(refuses)) - names.begin());
      EXPECT_EQ(read_after(r.get(), 2), right_image()) << refuses;
    }
    EXPECT_EQ(render_with(folder_).binaries, 2U) << refuses;
  }
}

TEST_F(KeptPrograms, GoWhenTheyTakeTooMuchRoom) {
  const ProgramCache cache(folder_);
  for (const char* name : {"0.program", "1.program"}) {
    std::ofstream(folder_ / name) << "x";
    fs::resize_file(folder_ / name, 200U << 20);  // a hole
    fs::last_write_time(folder_ / name, fs::last_write_time(entry_) - std::chrono::hours(name[0] == '0' ? 2 : 1));
  }
  cache.keep("key", ProgramCache::Bytes(100, 'x'));
  EXPECT_FALSE(fs::exists(folder_ / "0.program")) << "used longest ago";
  EXPECT_TRUE(fs::exists(folder_ / "1.program"));
  EXPECT_TRUE(fs::exists(entry_));
  ASSERT_TRUE(cache.find("key"));
  EXPECT_EQ(cache.find("key")->size(), 100U);
}

TEST(ProgramFolders, OthersAreRefused) {
  const Scratch scratch;
  const Handle r = create();
  const auto refused = [&](const fs::path& folder, const char* says) {
    EXPECT_EQ(parian_set_cache(r.get(), folder.c_str()), PARIAN_INVALID_ARGUMENT) << folder;
    EXPECT_NE(std::string(parian_message()).find(says), std::string::npos) << parian_message();
  };
  refused("", "empty");
  refused(scratch.write("file", ""), "no folder");
  refused(scratch / "file/programs", "can't be made");
  fs::create_directory(scratch / "open");
  fs::permissions(scratch / "open", fs::perms(0755));
  refused(scratch / "open", "0700");
  fs::create_directory(scratch / "mine");
  fs::permissions(scratch / "mine", fs::perms::owner_all);
  fs::create_directory_symlink(scratch / "mine", scratch / "link");
  refused(scratch / "link", "0700");
  if (geteuid() == 0) {
    fs::create_directory(scratch / "theirs");
    fs::permissions(scratch / "theirs", fs::perms::owner_all);
    ASSERT_EQ(chown((scratch / "theirs").c_str(), 65534, 65534), 0);
    refused(scratch / "theirs", "own");
  }
  EXPECT_EQ(parian_set_cache(r.get(), (scratch / "mine").c_str()), PARIAN_SUCCESS) << parian_message();
  EXPECT_EQ(parian_set_cache(r.get(), nullptr), PARIAN_SUCCESS) << parian_message();
}

// A folder that is taken away, or filled, while it is in use.
TEST(ProgramFolders, MayVanish) {
  const Scratch scratch;
  const SmallScene scene;
  const cl::Context context(opencl().device);
  const Handle r = create(in_context(context));
  CALL(parian_set_cache(r.get(), (scratch / "programs").c_str()));
  fs::remove(scratch / "programs");
  CALL(scene.give(r.get()));
  CALL(parian_plan(r.get(), nullptr));
  EXPECT_EQ(read_after(r.get(), 2), right_image());
  EXPECT_FALSE(fs::exists(scratch / "programs"));
}

TEST(SharedPrograms, AreBuiltOnceInAContext) {
  const SmallScene scene;
  const cl::Context context(opencl().device), other(opencl().device);
  (void)right_image();  // before anything is counted
  OpenclWatch watch;
  {
    std::vector<Handle> all;
    for (const cl::Context& of : {context, context, other}) {
      all.push_back(create(in_context(of)));
      CALL(scene.give(all.back().get()));
      CALL(parian_plan(all.back().get(), nullptr));
    }
    EXPECT_EQ(watch.calls("clBuildProgram"), 4U) << "two for each context";
    all.erase(all.begin());  // the one that has built it
    EXPECT_EQ(read_after(all[0].get(), 2), right_image());
    EXPECT_EQ(read_after(all[1].get(), 2), right_image());
  }
  EXPECT_EQ(watch.unbalanced(), "");
  const Handle later = create(in_context(context));
  CALL(scene.give(later.get()));
  CALL(parian_plan(later.get(), nullptr));
  EXPECT_EQ(watch.calls("clBuildProgram"), 6U) << "nobody had them any more";
}

TEST(SharedPrograms, OneThatFailsIsTriedAgain) {
  const SmallScene scene;
  const cl::Context context(opencl().device);
  const Handle a = create(in_context(context)), b = create(in_context(context));
  CALL(scene.give(a.get()));
  CALL(scene.give(b.get()));
  {
    OpenclWatch watch;
    watch.fail(0, CL_OUT_OF_HOST_MEMORY);
    EXPECT_EQ(parian_plan(a.get(), nullptr), PARIAN_OUT_OF_MEMORY);
  }
  CALL(parian_plan(b.get(), nullptr));
  EXPECT_EQ(read_after(b.get(), 2), right_image());
  CALL(parian_plan(a.get(), nullptr));
  EXPECT_EQ(read_after(a.get(), 2), right_image());
}

/// Halves of the device under test; none where it can't be divided.
std::vector<cl::Device> halves() {
  cl::Device device = opencl().device;
  const auto units = device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
  const cl_device_partition_property properties[] = {CL_DEVICE_PARTITION_EQUALLY,
                                                     static_cast<cl_device_partition_property>(units / 2), 0};
  std::vector<cl::Device> parts;
  try {
    if (units >= 2) device.createSubDevices(properties, &parts);
  } catch (const cl::Error&) {
    parts.clear();
  }
  return parts;
}

TEST(Subdevices, RenderTheSame) {
  std::vector<cl::Device> parts = halves();
  if (parts.empty()) GTEST_SKIP() << "this device can't be divided";
  const SmallScene scene;
  // In a context that was made for them, and in the whole device's.
  for (const cl::Context& context : {cl::Context(parts), cl::Context(opencl().device)}) {
    auto info = in_context(context);
    info.device = parts[0]();
    parian_renderer* made = nullptr;
    const parian_status status = parian_create(&info, &made);
    const Handle r(made, &parian_release);
    if (status != PARIAN_SUCCESS) {  // where no queue can be made either
      cl_int code = CL_SUCCESS;
      const cl::CommandQueue queue(clCreateCommandQueue(context(), parts[0](), 0, &code));
      EXPECT_EQ(status, PARIAN_INVALID_ARGUMENT);
      EXPECT_NE(code, CL_SUCCESS) << parian_message();
      continue;
    }
    const cl::CommandQueue queue(context, parts[0]);
    CALL(scene.give(r.get()));
    CALL(parian_plan(r.get(), queue()));
    EXPECT_EQ(read_after(r.get(), 2, queue()), right_image());
    auto described = sized<parian_device>();
    CALL(parian_get_device(r.get(), &described));
    EXPECT_EQ(described.compute_units, parts[0].getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>());
  }
}

TEST(Subdevices, OfAnotherContextAreRefused) {
  std::vector<cl::Device> parts = halves();
  if (parts.size() < 2) GTEST_SKIP() << "this device can't be divided in two";
  const cl::Context context(parts[1]);
  cl_int code = CL_SUCCESS;
  const cl::CommandQueue queue(clCreateCommandQueue(context(), parts[0](), 0, &code));
  auto info = in_context(context);
  info.device = parts[0]();
  parian_renderer* made = nullptr;
  const parian_status status = parian_create(&info, &made);
  EXPECT_EQ(status, code == CL_SUCCESS ? PARIAN_SUCCESS : PARIAN_INVALID_ARGUMENT) << parian_message();
  parian_release(made);
}

}  // namespace
}  // namespace parian::test
