// OpenCL calls of a renderer's whole life fail one by one, from every place that makes any, or all of them: the call of
// the API that it was for says so with the right status, nothing leaks, and what comes after gives the right image.
#include <map>
#include <optional>
#include <set>

#include "life.hpp"
#include "opencl_watch.hpp"

namespace parian::test {
namespace {

struct Fault {
  cl_int code;
  parian_status status;
};
constexpr Fault faults[] = {{CL_OUT_OF_HOST_MEMORY, PARIAN_OUT_OF_MEMORY},
                            {CL_OUT_OF_RESOURCES, PARIAN_DEVICE_LOST},
                            {CL_INVALID_VALUE, PARIAN_DEVICE_FAILED},
                            {CL_MEM_OBJECT_ALLOCATION_FAILURE, PARIAN_OUT_OF_MEMORY},
                            {CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST, PARIAN_DEVICE_FAILED}};

/// Which call of a life fails: the n-th of all, or of those from one place in the program.
struct Call {
  std::optional<Place> place;
  std::uint64_t n = 0;
};
constexpr std::uint64_t never = ~std::uint64_t{0};

/// One call of a life fails, whose releases count too; what went wrong after that, "" if nothing, and the function that
/// failed, "" if the life has no such call. Until then, calls by place.
struct Outcome {
  std::string wrong, failed;
  bool noticed = false;
  std::vector<std::pair<Place, std::uint64_t>> places;
};

/// What lives and short lives give if nothing fails.
struct Right {
  Rgba image, read, short_image;
};

/// Whether nothing is left of it, but what the release that failed was to release.
std::string leaks(const OpenclWatch& watch) {
  const std::string left = watch.unbalanced();
  const bool release =
      watch.failed().find("clRelease") == 0 && left.find("1 ") == 0 && left.find(',') == std::string::npos;
  return release || left.empty() ? "" : left + " left";
}

std::string short_life(Life& life, const Right& right) {
  if (life.render_shortly() != PARIAN_SUCCESS) return parian_message();
  return life.image() == right.short_image ? "" : "another image";
}

Outcome with_fault(Life& life, const Call& call, const Fault& fault, const Right& right) {
  OpenclWatch watch;
  watch.build_once();
  if (!deep()) watch.tell_places();
  if (call.place)
    watch.fail_at(*call.place, call.n, fault.code);
  else
    watch.fail(call.n, fault.code);
  const parian_status status = life.live();
  const bool while_living = !watch.failed().empty();
  if (!while_living) life.renderer.reset();
  Outcome o{"", watch.failed(), status != PARIAN_SUCCESS, watch.places()};
  watch.fail(never, CL_SUCCESS);
  if (status == PARIAN_SUCCESS) {
    if (life.image() != right.image || life.rgba != right.read) o.wrong = "unnoticed, and the image is another";
  } else if (status != fault.status || parian_opencl_code() != fault.code || *parian_message() == 0) {
    o.wrong =
        "status " + std::to_string(status) + ", code " + std::to_string(parian_opencl_code()) + ": " + parian_message();
  } else if (life.renderer && status == PARIAN_DEVICE_LOST) {
    if (life.render_shortly() != PARIAN_DEVICE_LOST) o.wrong = "the device is lost no more";
  } else if (life.renderer) {
    const std::string what = short_life(life, right);
    if (!what.empty()) o.wrong = "the same renderer again: " + what;
  }
  life.end();
  if (o.wrong.empty()) o.wrong = leaks(watch);
  return o;
}

/// What lives of a kind give.
void learn(Life& life, Right& right) {
  OpenclWatch watch;
  watch.build_once();
  CALL(life.live());
  right.image = life.image();
  right.read = life.rgba;
  life.renderer.reset();
  ASSERT_EQ(short_life(life, right), "another image");  // so far none is right
  CALL(life.render_shortly());
  right.short_image = life.image();
  life.end();
  ASSERT_EQ(watch.unbalanced(), "");
}

/// Calls of a life fail one by one, and each time the same renderer, unless the device was lost, and a fresh one render
/// afterwards: the first or, in turn, the last call from each place in the program; in the long form every call. Lives
/// differ by some calls, since what a frame asks of commands before it depends on how far these are: a call may be
/// missing, and in the long form the first life that ends before its n-th call is the last.
void every_call_fails(Kind kind) {
  Life life(kind);
  Right right;
  learn(life, right);
  if (testing::Test::HasFatalFailure()) return;
  expect_picture(right.image);
  expect_picture(right.short_image);
  if (kind != Kind::host) expect_picture(right.read);
  std::set<std::string> functions;
  std::map<std::string, int> unnoticed;
  std::vector<Call> calls{{{}, deep() ? 0 : never}};  // in the short form, the first life tells where there are calls
  std::uint64_t failed = 0, missing = 0;
  for (std::size_t i = 0; i < calls.size(); ++i) {
    const Outcome o = with_fault(life, calls[i], faults[i % std::size(faults)], right);
    const std::string what = std::to_string(i) + ": " + o.failed + " failed, then ";
    ASSERT_EQ(o.wrong, "") << what;
    if (calls[i].n == never) {
      for (const auto& [place, count] : o.places) calls.push_back({place, calls.size() % 2 == 0 ? 0 : count - 1});
      continue;
    }
    if (o.failed.empty()) {
      ++missing;
      continue;
    }
    if (deep()) calls.push_back({{}, i + 1});
    ++failed;
    functions.insert(o.failed);
    if (!o.noticed) ++unnoticed[o.failed];
    OpenclWatch watch;
    watch.build_once();
    ASSERT_EQ(short_life(life, right), "") << what << "a fresh renderer";
    life.end();
    ASSERT_EQ(watch.unbalanced(), "") << what << "a fresh renderer";
  }
  std::string text;
  for (const auto& [name, count] : unnoticed) text += " " + name + " x" + std::to_string(count);
  std::printf("%s%lu calls failed one by one, of %zu functions; without harm:%s\n", deep() ? "all " : "",
              static_cast<unsigned long>(failed), functions.size(), text.c_str());
  EXPECT_GT(functions.size(), 20U);
  EXPECT_LE(missing, deep() ? 1 : failed / 20);
}

TEST(Faults, EveryCall) { every_call_fails(Kind::host); }
TEST(Faults, EveryCallWithBuffersOfTheCaller) { every_call_fails(Kind::buffers); }
TEST(Faults, EveryCallWithFixedCameras) { every_call_fails(Kind::fixed); }

// A driver whose compiler throws for want of memory is left with its locks taken: whatever is asked of it next may wait
// for ever, a release as well.
TEST(Faults, ExceptionsOutOfTheDriver) {
  for (const char* name : {"clCreateProgramWithSource", "clBuildProgram", "clCreateKernel", "clCreateBuffer",
                           "clEnqueueNDRangeKernel", "clEnqueueReadBuffer", "clEnqueueFillBuffer", "clWaitForEvents"}) {
    const cl::Context context(opencl().device);  // what shares programs with it is lost, too
    SmallScene scene;
    const auto buffer = [&](auto& data) {
      return cl::Buffer(context, CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, data.size() * sizeof data[0], data.data());
    };
    const cl::Buffer vertices = buffer(scene.positions), triangles = buffer(scene.indices);
    OpenclWatch watch;
    Handle r = create(in_context(context));
    const parian_mesh mesh = SmallScene::mesh(scene, vertices, triangles);
    CALL(parian_set_mesh(r.get(), &mesh));
    CALL(scene.describe(r.get()));
    watch.leave_by_exception(name);
    EXPECT_EQ(parian_plan(r.get(), nullptr), PARIAN_DEVICE_LOST) << name << ": " << parian_message();
    EXPECT_EQ(watch.failed(), name);
    EXPECT_STREQ(watch.names().back(), name) << "was not the last call";
    EXPECT_NE(std::string(parian_message()).find("exception"), std::string::npos) << parian_message();
    const std::uint64_t calls = watch.calls();
    EXPECT_EQ(parian_plan(r.get(), nullptr), PARIAN_DEVICE_LOST) << name;
    EXPECT_EQ(parian_set_mesh(r.get(), &mesh), PARIAN_DEVICE_LOST) << name;
    r.reset();
    EXPECT_EQ(watch.calls(), calls) << name << ", then " << watch.names().back();
    const Handle other = create(in_context(context));
    CALL(scene.give(other.get()));
    EXPECT_EQ(parian_plan(other.get(), nullptr), PARIAN_DEVICE_LOST) << name << ": another renderer of the context";
  }
}

/// Parian picks the device itself: what doesn't answer is passed over, and if nothing is left the status says so.
TEST(Faults, EveryCallOfPickingADevice) {
  const std::string name = opencl().device.getInfo<CL_DEVICE_NAME>();
  auto info = sized<parian_create_info>();
  info.selector = name.c_str();
  std::uint64_t calls = 0;
  {
    OpenclWatch watch;
    create(info).reset();
    calls = watch.calls();
  }
  for (std::uint64_t n = 0; n < calls; ++n)
    for (const Fault& fault : faults) {
      OpenclWatch watch;
      watch.fail(n, fault.code);
      parian_renderer* made = nullptr;
      const parian_status status = parian_create(&info, &made);
      EXPECT_TRUE(status == PARIAN_SUCCESS || status == PARIAN_DEVICE_FAILED || status == fault.status)
          << watch.failed() << ": " << parian_message();
      EXPECT_EQ(status == PARIAN_SUCCESS, made != nullptr);
      parian_release(made);
      EXPECT_TRUE(watch.unbalanced().empty() || watch.failed().find("clRelease") == 0)
          << watch.failed() << ": " << watch.unbalanced();
    }
}

}  // namespace
}  // namespace parian::test
