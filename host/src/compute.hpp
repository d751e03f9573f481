// One OpenCL device at work: context, queue, program, buffers and launches, with their times and sizes counted.
#pragma once
#include <CL/opencl.hpp>
#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "embedded.hpp"
#include "error.hpp"
#include "renderer.hpp"

namespace parian {

class Compute {
 public:
  static constexpr std::size_t local_size = 64;  ///< of every launch: drivers compile each size anew

  /// Opens the device that `selector` means, as Renderer describes it.
  explicit Compute(const std::string& selector);
  /// Compiles `program`, which only tests change, with `options`. Throws Error(device) with the compiler's first error.
  void build(const std::string& options, const std::string& program = kernel_sources);

  template <class T>
  [[nodiscard]] cl::Buffer buffer(std::size_t count) {
    return allocate(std::max<std::size_t>(count, 1) * sizeof(T));
  }
  template <class T>
  [[nodiscard]] cl::Buffer upload(const std::vector<T>& data) {
    cl::Buffer b = buffer<T>(data.size());
    write(b, data);
    return b;
  }
  template <class T>
  void write(const cl::Buffer& b, const std::vector<T>& data, std::size_t first = 0) {
    if (!data.empty()) queue_.enqueueWriteBuffer(b, CL_TRUE, first * sizeof(T), data.size() * sizeof(T), data.data());
  }
  template <class T>
  [[nodiscard]] std::vector<T> read(const cl::Buffer& b, std::size_t count, std::size_t first = 0) {
    std::vector<T> data(count);
    if (count) queue_.enqueueReadBuffer(b, CL_TRUE, first * sizeof(T), count * sizeof(T), data.data());
    return data;
  }
  /// Fills with the 32-bit pattern `value`.
  void fill(const cl::Buffer& b, cl_uint value, std::size_t words);
  /// Copies the first words of a buffer to another.
  void copy(const cl::Buffer& from, const cl::Buffer& to, std::size_t words);
  /// Gives a buffer back before its owner ends.
  void release(cl::Buffer& b);

  /// Enqueues `items` work-items of a kernel, padded to whole work-groups; nothing when there are none.
  template <class... Args>
  void launch(const char* name, std::size_t items, Stage stage, const Args&... args) {
    if (items == 0) return;
    cl::Kernel& kernel = this->kernel(name);
    cl_uint i = 0;
    (kernel.setArg(i++, args), ...);
    enqueue(name, kernel, items, stage);
  }
  /// Waits for everything, and books kernel times.
  void finish();

  [[nodiscard]] const DeviceInfo& info() const { return info_; }
  [[nodiscard]] const std::map<Stage, double>& kernel_seconds() const { return seconds_; }
  [[nodiscard]] const KernelTable& kernel_table() const { return table_; }
  [[nodiscard]] std::uint64_t bytes_peak() const { return peak_; }

 private:
  cl::Buffer allocate(std::size_t bytes);
  cl::Kernel& kernel(const char* name);
  void enqueue(const char* name, const cl::Kernel& kernel, std::size_t items, Stage stage);

  struct Running {
    cl::Event event;
    Stage stage;
    std::string kernel;
    std::size_t items;
  };

  DeviceInfo info_;
  cl::Device device_;
  cl::Context context_;
  cl::CommandQueue queue_;
  cl::Program program_;
  std::map<std::string, cl::Kernel> kernels_;
  std::vector<Running> running_;
  std::map<Stage, double> seconds_;
  KernelTable table_;
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
    throw Error(ErrorKind::device, info.name + ": " + describe_cl_error(e));
  }
}

}  // namespace parian
