// Watches the OpenCL calls of this program: counts them, what they create and what they copy, and makes one of them
// fail. opencl_watch.cpp defines the functions themselves, so that the library, linked statically, calls those.
#pragma once
#include <CL/cl.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace parian::test {

/// Where a call comes from: a hash of the return addresses on the stack, the same all through a process.
using Place = std::uint64_t;

/// From its making to its end, one at a time; while there is none, calls go through untouched.
class OpenclWatch {
 public:
  OpenclWatch();
  ~OpenclWatch();
  OpenclWatch(const OpenclWatch&) = delete;
  OpenclWatch& operator=(const OpenclWatch&) = delete;

  /// The `n`-th call, from 0 at the watch's start, does nothing and returns `code`.
  void fail(std::uint64_t n, cl_int code);
  /// So does the `n`-th call that comes from a place in the program, from 0.
  void fail_at(Place place, std::uint64_t n, cl_int code);
  /// The next call of the function `name` is left by an exception, as a driver's compiler leaves it without memory.
  void leave_by_exception(const std::string& name);
  /// From now on, places are told and counted.
  void tell_places();
  /// How many calls have come from each place, in the order of their first.
  [[nodiscard]] std::vector<std::pair<Place, std::uint64_t>> places() const;
  /// Programs of one test, which have the same options, are built once: drivers take their time even with a cache.
  void build_once();

  /// Queues say that they are of this device.
  void pretend_device_of_queues(cl_device_id device);

  [[nodiscard]] std::uint64_t calls() const;
  [[nodiscard]] std::uint64_t calls(const std::string& name) const;
  /// Names of all calls so far.
  [[nodiscard]] const std::vector<const char*>& names() const;
  /// The function that was made to fail, "" before.
  [[nodiscard]] std::string failed() const;
  /// Bytes copied by writes and fills, or into buffers at their creation; and by reads.
  [[nodiscard]] std::uint64_t bytes_from_host() const;
  [[nodiscard]] std::uint64_t bytes_to_host() const;
  /// Calls that wait for the device.
  [[nodiscard]] std::uint64_t waits() const;
  /// Objects that were created or retained more often than released, or the reverse, as text; "" if none.
  [[nodiscard]] std::string unbalanced() const;
  /// How many more of one kind, as in that text.
  [[nodiscard]] std::int64_t more(const std::string& kind) const;
};

/// Whether this thread is in an OpenCL call.
bool inside_opencl();

}  // namespace parian::test
