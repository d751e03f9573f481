// One OpenCL device at work: context, queue, program, buffers and launches, with their times and sizes counted.
#pragma once
#include <CL/opencl.hpp>
#include <algorithm>
#include <array>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/device.hpp"
#include "core/embedded.hpp"
#include "core/error.hpp"
#include "core/program_cache.hpp"
#include "core/shared_program.hpp"
#include "core/stage.hpp"

namespace parian {

/// The handle that an OpenCL object says is its own, as `get` tells; not retained.
template <class T, class Get, class Object>
[[nodiscard]] T handle_of(Get get, Object object, cl_uint what) {
  T handle{};
  const cl_int code = get(object, what, sizeof(void*), &handle, nullptr);  // every handle is a pointer
  if (code != CL_SUCCESS) throw cl::Error(code, "asking an OpenCL object for another");
  return handle;
}

/// Thrown between commands when the caller's callback wants no more.
struct Cancelled {};

class Compute {
 public:
  /// Opens the device that `selector` means, as Renderer describes it.
  explicit Compute(const std::string& selector);
  /// The caller's context, which is retained, and a device of it.
  Compute(cl_context context, cl_device_id device);

  /// Where commands go from now on: a queue of this context and device, or one of its own if null. The first waits for
  /// `wait`; each waits for the one before, whatever queue that was on, so that out-of-order queues are as good as
  /// others. Throws Error(usage) where queue or events are another context's.
  void use(cl_command_queue queue, std::vector<cl::Event> wait);
  /// Flushes the queue; then the event that completes when everything enqueued has.
  [[nodiscard]] cl::Event submit();
  /// Lets go of the caller's queue.
  void leave() noexcept {
    cl::CommandQueue gone;  // assignment may throw what a release says
    std::swap(gone(), queue_());
  }
  /// Waits for everything that has been enqueued, whatever becomes of it.
  void drain() noexcept;
  /// Asked before kernels are compiled and before each launch; true throws Cancelled.
  void ask(std::function<bool()> cancelled) { cancelled_ = std::move(cancelled); }
  /// From now on, buffers are parts of this one.
  void take_scratch(cl::Buffer scratch);

  /// From now on, compiled programs are kept there.
  void use_cache(ProgramCache cache) { cache_ = std::move(cache); }
  /// From now on, kernels are those of the program `source` with `options`: compiled unless that has been here before,
  /// by another renderer of the context, or into the cache. Throws Error(device) with the compiler's first error.
  void build(const std::string& options, const std::string& source = render_sources);

  template <class T>
  [[nodiscard]] cl::Buffer buffer(std::size_t count) {
    return allocate(std::max<std::size_t>(count, 1) * sizeof(T));
  }
  template <class T>
  [[nodiscard]] cl::Buffer upload(const std::vector<T>& data) {
    Temporary b(*this, buffer<T>(data.size()));
    write(b, data);
    return std::move(static_cast<cl::Buffer&>(b));
  }
  /// Waits.
  template <class T>
  void write(const cl::Buffer& b, const std::vector<T>& data, std::size_t first = 0) {
    if (!data.empty()) transfer(b, true, first * sizeof(T), data.size() * sizeof(T), const_cast<T*>(data.data()));
  }
  /// Waits.
  template <class T>
  [[nodiscard]] std::vector<T> read(const cl::Buffer& b, std::size_t count, std::size_t first = 0) {
    std::vector<T> data(count);
    read_into(data, b, first);
    return data;
  }
  /// As many as there is room for. Waits.
  template <class T>
  void read_into(std::vector<T>& data, const cl::Buffer& b, std::size_t first = 0) {
    if (!data.empty()) transfer(b, false, first * sizeof(T), data.size() * sizeof(T), data.data());
  }
  /// Writes a few structs of 16 n bytes without waiting: as patterns, which OpenCL copies.
  template <class T>
  void assign(const cl::Buffer& b, const std::vector<T>& data) {
    static_assert(sizeof(T) % sizeof(Pattern) == 0);
    std::vector<Pattern> patterns(data.size() * sizeof(T) / sizeof(Pattern));
    std::memcpy(patterns.data(), data.data(), data.size() * sizeof(T));
    assign_patterns(b, patterns);
  }
  /// Fills with the 32-bit pattern `value`.
  void fill(const cl::Buffer& b, cl_uint value, std::size_t words);
  /// A buffer of one function, which exceptions leave without waiting for a driver that is of no use any more.
  class Temporary : public cl::Buffer {
   public:
    Temporary(const Compute& compute, cl::Buffer b) : cl::Buffer(std::move(b)), compute_(compute) {}
    ~Temporary() {
      if (compute_.abandoned()) (*this)() = nullptr;
    }
    Temporary(const Temporary&) = delete;
    Temporary& operator=(const Temporary&) = delete;

   private:
    const Compute& compute_;
  };
  /// Gives a buffer back before its owner ends.
  void release(cl::Buffer& b);
  /// The owner of all buffers has ended: counts anew. Commands that use them may still be running.
  void release_all() noexcept;

  /// Enqueues `items` work-items of a kernel, padded to whole work-groups; nothing when there are none.
  template <class... Args>
  void launch(const char* name, std::size_t items, Stage stage, const Args&... args) {
    if (items == 0) return;
    Prepared& kernel = prepared(name);
    kernel.arguments.resize(sizeof...(args));
    std::size_t i = 0;
    (kernel.set(i++, args), ...);
    enqueue(name, kernel, items, stage);
  }
  /// Launches of a kernel are cut into pieces of so many work-items: short ones, so that no watchdog fires.
  void limit(const std::string& kernel, std::size_t items) { limits_[kernel] = items; }
  /// Work-items that a kernel's groups have: a power of two, no more than the device can keep together.
  [[nodiscard]] std::size_t group_size(const char* name) { return group_size(prepared(name)); }
  /// What groups have at most, from the next launch on: few sizes, since drivers compile each anew. For tests.
  void limit_groups(std::size_t items) { most_in_group_ = items; }
  /// Waits for everything, and books kernel times.
  void finish();

  /// Whether an exception has left the driver in the middle of a call. Its frames were left as they were, with locks
  /// that nobody frees any more: no handle may be released, or used, again, and those in here are gone.
  [[nodiscard]] bool abandoned() const { return abandoned_; }

  [[nodiscard]] const DeviceInfo& info() const { return info_; }
  [[nodiscard]] const cl::Context& context() const { return context_; }
  [[nodiscard]] const cl::Device& device() const { return device_; }
  /// Of what has come to its end.
  [[nodiscard]] const std::map<Stage, double>& kernel_seconds() {
    book(false);
    return seconds_;
  }
  [[nodiscard]] const KernelTable& kernel_table() const { return table_; }
  [[nodiscard]] std::uint64_t bytes_peak() const { return peak_; }

 private:
  using Pattern = std::array<cl_uint, 4>;
  /// A kernel, what it said of itself, and the bytes of its arguments, so that those alone are set that change, and
  /// buffers: after its release a buffer's handle may be another's.
  struct Prepared {
    cl::Kernel kernel;
    std::size_t most_in_group;
    std::vector<std::vector<unsigned char>> arguments;

    template <class T>
    void set(std::size_t i, const T& value) {
      if constexpr (std::is_base_of_v<cl::Buffer, T>) {
        kernel.setArg(static_cast<cl_uint>(i), static_cast<const cl::Buffer&>(value));
        return;
      }
      const auto* bytes = reinterpret_cast<const unsigned char*>(&value);
      std::vector<unsigned char>& known = arguments[i];
      if (known.size() == sizeof value && std::memcmp(known.data(), bytes, sizeof value) == 0) return;
      known.clear();
      kernel.setArg(static_cast<cl_uint>(i), value);
      known.assign(bytes, bytes + sizeof value);
    }
  };
  [[nodiscard]] std::string cache_key(const std::string& options, const std::string& source) const;
  bool build_from_cache(SharedProgram& program, const std::string& key, const std::string& options);
  void build_from_source(SharedProgram& program, const std::string& options, const std::string& source);
  void keep_binary(SharedProgram& program, const std::string& key);
  static constexpr const char* lost_driver =
      ": the driver left a call by an exception, as for want of memory, and is of no use any more in this process; "
      "give the process more memory";
  cl::Buffer allocate(std::size_t bytes);
  cl::Buffer part_of_scratch(std::size_t bytes);
  Prepared& prepared(const char* name);
  [[nodiscard]] std::size_t group_size(const Prepared& kernel) const;
  void transfer(const cl::Buffer& b, bool to_device, std::size_t offset, std::size_t bytes, void* host);
  void assign_patterns(const cl::Buffer& b, const std::vector<Pattern>& patterns);
  void enqueue(const char* name, const Prepared& kernel, std::size_t items, Stage stage);
  /// Calls `command` with the events to wait for and the event to make, which the next command waits for.
  template <class F>
  const cl::Event& chain(F&& command) {
    after_.reserve(1);  // nothing may fail once the command is enqueued, or nobody would wait for it
    cl::Event event;
    in_driver([&] { command(after_.empty() ? nullptr : &after_, &event); });
    after_.clear();
    after_.push_back(std::move(event));
    return after_.back();
  }
  /// Runs a call of the driver. What it throws becomes Error(device), and the driver is abandoned: compilers run out of
  /// memory by exceptions.
  template <class F>
  decltype(auto) in_driver(F&& f) {
    try {
      return f();
    } catch (const cl::Error&) {  // a code that the driver returned
      throw;
    } catch (...) {
      abandon();
      throw Error(ErrorKind::device, info_.name + lost_driver, CL_OUT_OF_RESOURCES);
    }
  }
  void abandon() noexcept;
  void book(bool all);

  struct Running {
    cl::Event event;
    Stage stage;
    std::string kernel;
    std::size_t items;
  };
  struct Part {  // of the scratch buffer, in use
    std::size_t begin, end;
    cl_mem buffer;
  };

  DeviceInfo info_;
  cl::Device device_;
  cl::Context context_;
  cl::CommandQueue own_queue_, queue_;
  bool profiling_ = false;  // of queue_
  bool abandoned_ = false;
  std::vector<cl::Event> after_;
  std::function<bool()> cancelled_;
  ProgramCache cache_;
  /// A program, and those of its kernels that have been asked for.
  struct Program {
    std::shared_ptr<SharedProgram> shared;
    std::map<std::string, Prepared, std::less<>> kernels;
  };
  std::map<std::pair<std::string, std::string>, Program> programs_;  // by options and source
  Program* program_ = nullptr;                                       // whose kernels are launched
  std::map<std::string, std::size_t> limits_;
  cl::Buffer scratch_;
  std::vector<Part> parts_;
  std::deque<Running> running_;
  std::map<Stage, double> seconds_;
  KernelTable table_;
  std::size_t most_in_group_ = 64;
  std::uint64_t bytes_ = 0, peak_ = 0;
};

/// Runs `f`, turning OpenCL's errors into Error(device) with what was being done and the remedy.
template <class F>
decltype(auto) with_device_errors(const DeviceInfo& info, F&& f);
/// The name and remedy of an OpenCL error code, as "NAME (code): remedy".
[[nodiscard]] std::string describe_cl_error(const cl::Error& error);

template <class F>
decltype(auto) with_device_errors(const DeviceInfo& info, F&& f) {
  try {
    return f();
  } catch (const cl::Error& e) {
    throw Error(ErrorKind::device, info.name + ": " + describe_cl_error(e), e.err());
  }
}

}  // namespace parian
