// The n-th OpenCL call of a renderer's whole life fails, for n from its first to its last: the call of the API that it
// was for says so with the right status, nothing leaks, and what comes after gives the right image.
#include <map>
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

/// Which of a life's calls fail: the first and the last `edge`, of each function the first `each`, every `step`-th.
struct Choice {
  std::uint64_t edge, each, step;
};
std::vector<std::uint64_t> chosen(const std::vector<const char*>& names, const Choice& c) {
  std::vector<std::uint64_t> some;
  std::map<std::string, std::uint64_t> seen;
  for (std::uint64_t n = 0; n < names.size(); ++n) {
    const std::uint64_t before = seen[names[n]]++;
    if (n < c.edge || n + c.edge >= names.size() || before < c.each || n % c.step == 0) some.push_back(n);
  }
  return some;
}

void every_call_fails(Kind kind, const Choice& choice) {
  Rgba right;
  std::vector<const char*> names;
  {
    Life life(kind);
    OpenclWatch watch;
    watch.build_once();
    CALL(life.live());
    life.renderer.reset();
    right = life.rgba;
    names = watch.names();
    ASSERT_EQ(watch.unbalanced(), "");
  }
  expect_picture(right);
  const std::vector<std::uint64_t> calls = chosen(names, choice);
  std::map<std::string, int> tolerated;
  for (const std::uint64_t n : calls) {
    const Fault& fault = faults[n % std::size(faults)];
    Life life(kind);
    OpenclWatch watch;
    watch.build_once();
    watch.fail(n, fault.code);
    const parian_status status = life.live();
    // Not always names[n]: what a frame asks of commands before it depends on how far they are.
    const std::string failed = watch.failed(),
                      what = std::to_string(n) + ": " + failed + " returned " + std::to_string(fault.code);
    if (status == PARIAN_SUCCESS) {
      ++tolerated[failed];
      ASSERT_EQ(life.rgba, right) << what << ", unnoticed";
    } else {
      ASSERT_EQ(status, fault.status) << what << ": " << parian_message();
      ASSERT_EQ(parian_opencl_code(), fault.code) << what << ": " << parian_message();
      ASSERT_NE(std::string(parian_message()), "") << what;
    }
    if (failed.empty()) life.renderer.reset();  // whose release it is then
    watch.fail(~std::uint64_t{0}, CL_SUCCESS);
    if (status == PARIAN_DEVICE_LOST && life.renderer) {
      ASSERT_EQ(life.render(), PARIAN_DEVICE_LOST) << what;
      life.renderer.reset();
    }
    if (n % 3 == 0 && !failed.empty()) {
      ASSERT_EQ(life.renderer ? life.render() : life.live(), PARIAN_SUCCESS) << what << ", then " << parian_message();
      ASSERT_EQ(life.rgba, right) << what << ", and the image after it is another";
    }
    life.renderer.reset();
    const std::string left = watch.unbalanced();
    const bool release = watch.failed().find("clRelease") == 0;  // by now; then one may be left
    ASSERT_TRUE(left.empty() || (release && left.find("1 ") == 0 && left.find(',') == std::string::npos))
        << what << ": " << left << " left";
  }
  std::string text;
  for (const auto& [name, count] : tolerated) text += " " + name + " x" + std::to_string(count);
  std::printf("%zu of %zu calls failed one by one, of %zu functions; without harm:%s\n", calls.size(), names.size(),
              std::set<std::string>(names.begin(), names.end()).size(), text.c_str());
}

TEST(Faults, EveryCall) { every_call_fails(Kind::host, {200, 12, 251}); }
TEST(Faults, EveryCallWithBuffersOfTheCaller) { every_call_fails(Kind::buffers, {20, 6, 997}); }
TEST(Faults, EveryCallWithFixedCameras) { every_call_fails(Kind::fixed, {20, 6, 997}); }

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
