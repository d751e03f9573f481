// The OpenCL functions that the library and its tests call, each passed on to the next library that has it.
#include "opencl_watch.hpp"

#include <dlfcn.h>
#include <execinfo.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <tuple>

#include "small_scene.hpp"

namespace parian::test {
namespace {

struct State {
  std::uint64_t waits = 0, from_host = 0, to_host = 0;
  std::vector<const char*> names;
  std::map<std::string, std::int64_t> live;
  std::optional<std::uint64_t> failing;
  cl_int failing_code = CL_SUCCESS;
  std::string failed, leaving;
  bool telling = false;
  std::vector<std::pair<Place, std::uint64_t>> places;
  std::map<Place, std::size_t> index_of;
  std::optional<Place> failing_place;
  std::string once;  // the test whose programs are shared
  cl_device_id pretended = nullptr;
};

std::mutex mutex;
std::optional<State> watch;

/// Programs by test, context and source; what they were built with.
struct Program {
  cl_program handle;
  std::string options;
};
std::map<std::tuple<std::string, cl_context, std::string>, Program> programs;

thread_local int depth = 0;
struct Inside {
  Inside() { ++depth; }
  ~Inside() { --depth; }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;
};

Place place_of_call() {
  std::array<void*, 64> frames;
  const int count = backtrace(frames.data(), static_cast<int>(frames.size()));
  Place hash = 14695981039346656037U;  // FNV-1a
  for (int i = 0; i < count; ++i) hash = (hash ^ reinterpret_cast<std::uintptr_t>(frames[i])) * 1099511628211U;
  return hash;
}

/// Counts a call; what it is to return, if it is to fail.
cl_int entered(const char* name) {
  const std::scoped_lock lock(mutex);
  if (!watch) return CL_SUCCESS;
  watch->names.push_back(name);
  if (watch->leaving == name) {
    watch->failed = std::exchange(watch->leaving, "");
    throw std::bad_alloc();
  }
  std::uint64_t n = watch->names.size() - 1;
  if (watch->telling) {
    const Place place = place_of_call();
    const auto [known, first] = watch->index_of.try_emplace(place, watch->places.size());
    if (first) watch->places.emplace_back(place, 0);
    n = watch->places[known->second].second++;
    if (watch->failing_place != place) return CL_SUCCESS;
  }
  if (n != watch->failing) return CL_SUCCESS;
  watch->failed = name;
  return watch->failing_code;
}

template <class F>
void note(F&& f) {
  const std::scoped_lock lock(mutex);
  if (watch) f(*watch);
}

void live(const char* kind, int change) {
  note([&](State& s) { s.live[kind] += change; });
}

/// Of a command that makes an event if it is asked to.
void event_made(const cl_event* event) {
  if (event) live("events", 1);
}

template <class F>
F next(F, const char* name) {
  void* found = dlsym(RTLD_NEXT, name);
  if (!found) throw std::runtime_error(std::string("no OpenCL function ") + name);
  F f;
  std::memcpy(&f, &found, sizeof f);
  return f;
}

}  // namespace

bool inside_opencl() { return depth > 0; }

OpenclWatch::OpenclWatch() {
  opencl();  // what all tests share is made before anything is counted
  const std::scoped_lock lock(mutex);
  watch.emplace();
}
OpenclWatch::~OpenclWatch() {
  const std::scoped_lock lock(mutex);
  watch.reset();
}
void OpenclWatch::fail(std::uint64_t n, cl_int code) {
  note([&](State& s) {
    s.failing = n;
    s.failing_code = code;
  });
}
void OpenclWatch::fail_at(Place place, std::uint64_t n, cl_int code) {
  fail(n, code);
  note([&](State& s) { s.failing_place = place; });
}
void OpenclWatch::leave_by_exception(const std::string& name) {
  note([&](State& s) { s.leaving = name; });
}
void OpenclWatch::tell_places() {
  note([](State& s) { s.telling = true; });
}
std::vector<std::pair<Place, std::uint64_t>> OpenclWatch::places() const { return watch->places; }
void OpenclWatch::build_once() {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  note([&](State& s) { s.once = std::string(test->test_suite_name()) + "." + test->name(); });
}
void OpenclWatch::pretend_device_of_queues(cl_device_id device) {
  note([&](State& s) { s.pretended = device; });
}
std::uint64_t OpenclWatch::calls() const { return watch->names.size(); }
std::uint64_t OpenclWatch::calls(const std::string& name) const {
  return static_cast<std::uint64_t>(std::count(watch->names.begin(), watch->names.end(), name));
}
const std::vector<const char*>& OpenclWatch::names() const { return watch->names; }
std::string OpenclWatch::failed() const { return watch->failed; }
std::uint64_t OpenclWatch::bytes_from_host() const { return watch->from_host; }
std::uint64_t OpenclWatch::bytes_to_host() const { return watch->to_host; }
std::uint64_t OpenclWatch::waits() const { return watch->waits; }
std::int64_t OpenclWatch::more(const std::string& kind) const {
  const auto found = watch->live.find(kind);
  return found == watch->live.end() ? 0 : found->second;
}
std::string OpenclWatch::unbalanced() const {
  std::string text;
  for (const auto& [kind, count] : watch->live)
    if (count != 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + kind;
  return text;
}

}  // namespace parian::test

using namespace parian::test;

// A function that returns a code: `after` if it succeeds.
#define CODE(name, parameters, arguments, after)       \
  cl_int CL_API_CALL name parameters {                 \
    const Inside inside;                               \
    static const auto pass = next(&(name), #name);     \
    if (const cl_int bad = entered(#name)) return bad; \
    const cl_int code = pass arguments;                \
    if (code == CL_SUCCESS) {                          \
      after;                                           \
    }                                                  \
    return code;                                       \
  }

// A function that returns an object and puts the code where its last parameter, `code`, points to.
#define OBJECT(type, kind, name, parameters, arguments, after) \
  type CL_API_CALL name parameters {                           \
    const Inside inside;                                       \
    static const auto pass = next(&(name), #name);             \
    if (const cl_int bad = entered(#name)) {                   \
      if (code) *code = bad;                                   \
      return nullptr;                                          \
    }                                                          \
    const type made = pass arguments;                          \
    if (made) {                                                \
      live(kind, 1);                                           \
      after;                                                   \
    }                                                          \
    return made;                                               \
  }

#define COUNTED(type, kind, retain, release)           \
  CODE(retain, (type object), (object), live(kind, 1)) \
  CODE(release, (type object), (object), live(kind, -1))

#define WAITS(condition, bytes, counter) \
  note([&](State& s) {                   \
    s.counter += (bytes);                \
    s.waits += (condition) ? 1 : 0;      \
  });                                    \
  event_made(event)

extern "C" {

COUNTED(cl_device_id, "devices", clRetainDevice, clReleaseDevice)
COUNTED(cl_context, "contexts", clRetainContext, clReleaseContext)
COUNTED(cl_command_queue, "queues", clRetainCommandQueue, clReleaseCommandQueue)
COUNTED(cl_mem, "buffers", clRetainMemObject, clReleaseMemObject)
COUNTED(cl_program, "programs", clRetainProgram, clReleaseProgram)
COUNTED(cl_kernel, "kernels", clRetainKernel, clReleaseKernel)
COUNTED(cl_event, "events", clRetainEvent, clReleaseEvent)

OBJECT(cl_context, "contexts", clCreateContext,
       (const cl_context_properties* properties, cl_uint n, const cl_device_id* devices,
        void(CL_CALLBACK* notify)(const char*, const void*, size_t, void*), void* user, cl_int* code),
       (properties, n, devices, notify, user, code), )
OBJECT(cl_command_queue, "queues", clCreateCommandQueue,
       (cl_context context, cl_device_id device, cl_command_queue_properties properties, cl_int* code),
       (context, device, properties, code), )
OBJECT(cl_mem, "buffers", clCreateBuffer,
       (cl_context context, cl_mem_flags flags, size_t size, void* host, cl_int* code),
       (context, flags, size, host, code), if (host) note([&](State& s) { s.from_host += size; }))
OBJECT(cl_mem, "buffers", clCreateSubBuffer,
       (cl_mem buffer, cl_mem_flags flags, cl_buffer_create_type type, const void* info, cl_int* code),
       (buffer, flags, type, info, code), )
OBJECT(cl_kernel, "kernels", clCreateKernel, (cl_program program, const char* name, cl_int* code),
       (program, name, code), )
OBJECT(cl_program, "programs", clCreateProgramWithBinary,
       (cl_context context, cl_uint n, const cl_device_id* devices, const size_t* lengths,
        const unsigned char** binaries, cl_int* of_device, cl_int* code),
       (context, n, devices, lengths, binaries, of_device, code), )
OBJECT(cl_event, "events", clCreateUserEvent, (cl_context context, cl_int* code), (context, code), )

cl_program CL_API_CALL clCreateProgramWithSource(cl_context context, cl_uint n, const char** strings,
                                                 const size_t* lengths, cl_int* code) {
  const Inside inside;
  static const auto pass = next(&clCreateProgramWithSource, "clCreateProgramWithSource");
  if (const cl_int bad = entered("clCreateProgramWithSource")) {
    if (code) *code = bad;
    return nullptr;
  }
  std::string source;
  for (cl_uint i = 0; i < n; ++i)
    source += lengths && lengths[i] ? std::string(strings[i], lengths[i]) : std::string(strings[i]);
  live("programs", 1);
  std::string once;
  note([&](const State& s) { once = s.once; });
  const auto known = programs.find({once, context, source});
  if (!once.empty() && known != programs.end()) {
    static const auto retain = next(&clRetainProgram, "clRetainProgram");
    retain(known->second.handle);
    if (code) *code = CL_SUCCESS;
    return known->second.handle;
  }
  const cl_program made = pass(context, n, strings, lengths, code);
  if (!once.empty() && made) {
    static const auto retain = next(&clRetainProgram, "clRetainProgram");
    retain(made);  // for good
    programs[{once, context, source}] = {made, ""};
  }
  return made;
}

cl_int CL_API_CALL clBuildProgram(cl_program program, cl_uint n, const cl_device_id* devices, const char* options,
                                  void(CL_CALLBACK* notify)(cl_program, void*), void* user) {
  const Inside inside;
  static const auto pass = next(&clBuildProgram, "clBuildProgram");
  if (const cl_int bad = entered("clBuildProgram")) return bad;
  for (auto& [key, known] : programs) {
    if (known.handle != program) continue;
    if (known.options == options) return CL_SUCCESS;
    const cl_int code = pass(program, n, devices, options, notify, user);
    if (code == CL_SUCCESS) known.options = options;
    return code;
  }
  return pass(program, n, devices, options, notify, user);
}

CODE(clEnqueueWriteBuffer,
     (cl_command_queue queue, cl_mem buffer, cl_bool blocking, size_t offset, size_t size, const void* host,
      cl_uint n_wait, const cl_event* wait, cl_event* event),
     (queue, buffer, blocking, offset, size, host, n_wait, wait, event), WAITS(blocking, size, from_host))
CODE(clEnqueueReadBuffer,
     (cl_command_queue queue, cl_mem buffer, cl_bool blocking, size_t offset, size_t size, void* host, cl_uint n_wait,
      const cl_event* wait, cl_event* event),
     (queue, buffer, blocking, offset, size, host, n_wait, wait, event), WAITS(blocking, size, to_host))
CODE(clEnqueueFillBuffer,
     (cl_command_queue queue, cl_mem buffer, const void* pattern, size_t pattern_size, size_t offset, size_t size,
      cl_uint n_wait, const cl_event* wait, cl_event* event),
     (queue, buffer, pattern, pattern_size, offset, size, n_wait, wait, event), WAITS(false, pattern_size, from_host))
CODE(clEnqueueNDRangeKernel,
     (cl_command_queue queue, cl_kernel kernel, cl_uint dimensions, const size_t* offset, const size_t* global,
      const size_t* local, cl_uint n_wait, const cl_event* wait, cl_event* event),
     (queue, kernel, dimensions, offset, global, local, n_wait, wait, event), event_made(event))
CODE(clEnqueueMarkerWithWaitList, (cl_command_queue queue, cl_uint n_wait, const cl_event* wait, cl_event* event),
     (queue, n_wait, wait, event), event_made(event))
CODE(clFlush, (cl_command_queue queue), (queue), )
CODE(clFinish, (cl_command_queue queue), (queue), note([](State& s) { ++s.waits; }))
CODE(clWaitForEvents, (cl_uint n, const cl_event* events), (n, events), note([](State& s) { ++s.waits; }))

CODE(clSetKernelArg, (cl_kernel kernel, cl_uint index, size_t size, const void* value), (kernel, index, size, value), )

CODE(clGetPlatformIDs, (cl_uint n, cl_platform_id* platforms, cl_uint* found), (n, platforms, found), )
CODE(clGetDeviceIDs, (cl_platform_id platform, cl_device_type type, cl_uint n, cl_device_id* devices, cl_uint* found),
     (platform, type, n, devices, found), )

#define QUERY(name, object, info) \
  CODE(name, (object o, info what, size_t size, void* value, size_t* needed), (o, what, size, value, needed), )
QUERY(clGetPlatformInfo, cl_platform_id, cl_platform_info)
QUERY(clGetDeviceInfo, cl_device_id, cl_device_info)
QUERY(clGetContextInfo, cl_context, cl_context_info)
CODE(clGetCommandQueueInfo,
     (cl_command_queue queue, cl_command_queue_info what, size_t size, void* value, size_t* needed),
     (queue, what, size, value, needed), if (what == CL_QUEUE_DEVICE && value) note([&](const State& s) {
       if (s.pretended) std::memcpy(value, &s.pretended, sizeof(cl_device_id));
     }))
QUERY(clGetMemObjectInfo, cl_mem, cl_mem_info)
QUERY(clGetProgramInfo, cl_program, cl_program_info)
QUERY(clGetEventInfo, cl_event, cl_event_info)
QUERY(clGetEventProfilingInfo, cl_event, cl_profiling_info)
CODE(clGetKernelWorkGroupInfo,
     (cl_kernel kernel, cl_device_id device, cl_kernel_work_group_info what, size_t size, void* value, size_t* needed),
     (kernel, device, what, size, value, needed), )
CODE(clGetProgramBuildInfo,
     (cl_program program, cl_device_id device, cl_program_build_info what, size_t size, void* value, size_t* needed),
     (program, device, what, size, value, needed), )

}  // extern "C"
