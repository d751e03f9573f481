// The n-th allocation of host memory in a renderer's whole life fails: nothing but a status leaves the library.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "life.hpp"
#include "opencl_watch.hpp"

namespace {
thread_local std::int64_t until_failure = -1;  // allocations of this thread's outside OpenCL; negative: none fails

void* allocated(std::size_t size) noexcept {
  const bool fails = until_failure >= 0 && !parian::test::inside_opencl() && until_failure-- == 0;
  return fails ? nullptr : std::malloc(size > 0 ? size : 1);
}
}  // namespace

[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return allocated(size); }
[[gnu::noinline]] void* operator new(std::size_t size) {
  if (void* p = allocated(size)) return p;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace parian::test {
namespace {

constexpr std::int64_t many = std::int64_t{1} << 40;

void allocations_fail(Kind kind) {
  Rgba right, right_read;
  std::int64_t count = 0;
  {
    Life life(kind);
    OpenclWatch watch;
    watch.build_once();
    until_failure = many;
    const parian_status status = life.live();
    count = many - until_failure;
    until_failure = -1;
    CALL(status);
    right = life.image();
    right_read = life.rgba;
  }
  expect_picture(right);
  std::int64_t failed = 0;
  for (std::int64_t n = 0; n < count; n += n < 100 ? 1 : 1 + n / 40, ++failed) {
    Life life(kind);
    OpenclWatch watch;
    watch.build_once();
    until_failure = n;
    parian_status status = life.live();
    until_failure = -1;
    if (status != PARIAN_SUCCESS) {
      ASSERT_EQ(status, PARIAN_OUT_OF_MEMORY) << n << ": " << parian_message();
      ASSERT_EQ(parian_opencl_code(), CL_SUCCESS) << n;
      if (n % 3 == 0) status = life.renderer ? life.render() : life.live();
      ASSERT_TRUE(status == PARIAN_SUCCESS || n % 3 != 0) << n << ", then " << parian_message();
    }
    if (status == PARIAN_SUCCESS) {
      ASSERT_EQ(life.image(), right) << n;
      ASSERT_EQ(life.rgba, right_read) << n;
    }
    life.end();
    ASSERT_EQ(watch.unbalanced(), "") << n;
  }
  std::printf("%ld of %ld allocations failed one by one\n", static_cast<long>(failed), static_cast<long>(count));
}

TEST(Faults, Allocations) { allocations_fail(Kind::host); }
TEST(Faults, AllocationsWithBuffersOfTheCaller) { allocations_fail(Kind::buffers); }

}  // namespace
}  // namespace parian::test
