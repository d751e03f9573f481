// Devices, the program, buffers and launches.
#include "compute.hpp"

#include <algorithm>
#include <cctype>

namespace parian {
namespace {

std::string lower(std::string s) {
  std::transform(s.begin(), s.end(), s.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return s;
}

std::string trimmed(std::string s) {
  while (!s.empty() && (s.back() == '\0' || std::isspace(static_cast<unsigned char>(s.back())))) s.pop_back();
  return s;
}

DeviceInfo describe(const cl::Platform& platform, const cl::Device& device) {
  DeviceInfo info;
  info.name = trimmed(device.getInfo<CL_DEVICE_NAME>());
  info.platform = trimmed(platform.getInfo<CL_PLATFORM_NAME>());
  info.vendor = trimmed(device.getInfo<CL_DEVICE_VENDOR>());
  info.driver = trimmed(device.getInfo<CL_DRIVER_VERSION>());
  info.version = trimmed(device.getInfo<CL_DEVICE_VERSION>());
  const cl_device_type type = device.getInfo<CL_DEVICE_TYPE>();
  info.type = type & CL_DEVICE_TYPE_GPU ? "GPU" : type & CL_DEVICE_TYPE_CPU ? "CPU" : "accelerator";
  info.compute_units = device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
  // CPU drivers report preferred widths that fit flat kernels; loops over samples want eight lanes everywhere.
  const bool cpu = info.type == "CPU" || lower(info.name).find("llvmpipe") != std::string::npos;
  info.vector_width = cpu ? 16 : 1;
  info.global_memory = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
  info.max_allocation = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
  return info;
}

/// All devices that can compile kernels, with their handles. What doesn't answer is passed over.
std::vector<std::pair<DeviceInfo, cl::Device>> all_devices() {
  std::vector<std::pair<DeviceInfo, cl::Device>> found;
  std::vector<cl::Platform> platforms;
  try {
    cl::Platform::get(&platforms);
  } catch (const cl::Error&) {
    return found;
  }
  for (const cl::Platform& platform : platforms) {
    std::vector<cl::Device> devices;
    try {
      platform.getDevices(CL_DEVICE_TYPE_ALL, &devices);
      for (const cl::Device& device : devices) {
        if (!device.getInfo<CL_DEVICE_AVAILABLE>() || !device.getInfo<CL_DEVICE_COMPILER_AVAILABLE>()) continue;
        found.emplace_back(describe(platform, device), device);
        found.back().first.index = static_cast<std::uint32_t>(found.size() - 1);
      }
    } catch (const cl::Error&) {
      continue;
    }
  }
  return found;
}

std::pair<DeviceInfo, cl::Device> pick(const std::string& selector) {
  const auto devices = all_devices();
  if (devices.empty())
    throw Error(ErrorKind::device,
                "no OpenCL device; install a driver, or pocl-opencl-icd to run on the CPU, and see 'parian devices'");
  const bool index = !selector.empty() &&
                     std::all_of(selector.begin(), selector.end(), [](unsigned char c) { return std::isdigit(c); });
  std::vector<std::pair<DeviceInfo, cl::Device>> fitting;
  for (const auto& d : devices) {
    const std::string text = lower(d.first.name + " " + d.first.platform);
    if (selector.empty() || (index && selector.size() < 6 && std::stoul(selector) == d.first.index) ||
        (!index && text.find(lower(selector)) != std::string::npos))
      fitting.push_back(d);
  }
  if (fitting.empty())
    throw Error(ErrorKind::device, "device '" + selector + "': no such OpenCL device; see 'parian devices'");
  const auto rank = [](const DeviceInfo& i) {
    return std::pair(i.type == "GPU" ? 2 : i.type == "accelerator" ? 1 : 0, i.compute_units);
  };
  return *std::max_element(fitting.begin(), fitting.end(),
                           [&](const auto& a, const auto& b) { return rank(a.first) < rank(b.first); });
}

}  // namespace

std::vector<DeviceInfo> list_devices() {
  std::vector<DeviceInfo> infos;
  for (const auto& d : all_devices()) infos.push_back(d.first);
  return infos;
}

std::string describe_cl_error(const cl::Error& error) {
  std::string name, remedy = "run 'parian devices', or choose another with --device";
  switch (error.err()) {
    case CL_MEM_OBJECT_ALLOCATION_FAILURE:
    case CL_OUT_OF_HOST_MEMORY:
    case CL_INVALID_BUFFER_SIZE:
      name = "out of memory";
      remedy = "lower --layer-size, --layers or --light-map-size";
      break;
    case CL_OUT_OF_RESOURCES:
      name = "out of resources";
      remedy = "the driver may have stopped a long kernel or lost the device; lower --samples or --layer-size";
      break;
    case CL_DEVICE_NOT_AVAILABLE:
    case CL_COMPILER_NOT_AVAILABLE:
      name = "device or its compiler not available";
      break;
    default:
      name = "OpenCL call failed";
  }
  return name + " (" + error.what() + ", code " + std::to_string(error.err()) + "); " + remedy;
}

Compute::Compute(const std::string& selector) {
  std::tie(info_, device_) = pick(selector);
  with_device_errors(info_, [&] {
    context_ = cl::Context(device_);
    queue_ = cl::CommandQueue(context_, device_, CL_QUEUE_PROFILING_ENABLE);
  });
}

void Compute::build(const std::string& options, const std::string& program) {
  with_device_errors(info_, [&] {
    program_ = cl::Program(context_, program);
    try {
      program_.build(device_, options.c_str());
    } catch (const cl::Error&) {
      const std::string log = program_.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device_);
      const std::size_t at = log.find("error"), begin = at == std::string::npos ? 0 : log.rfind('\n', at) + 1;
      throw Error(ErrorKind::device, info_.name + ": the kernels don't compile (" +
                                         log.substr(begin, log.find('\n', std::max(at, begin)) - begin) +
                                         "); update the driver or choose another with --device");
    }
  });
}

cl::Buffer Compute::allocate(std::size_t bytes) {
  cl::Buffer b(context_, CL_MEM_READ_WRITE, bytes);
  bytes_ += bytes;
  peak_ = std::max(peak_, bytes_);
  return b;
}

void Compute::release(cl::Buffer& b) {
  if (b()) bytes_ -= b.getInfo<CL_MEM_SIZE>();
  b = cl::Buffer();
}

void Compute::fill(const cl::Buffer& b, cl_uint value, std::size_t words) {
  if (words) queue_.enqueueFillBuffer(b, value, 0, words * sizeof(cl_uint));
}

void Compute::copy(const cl::Buffer& from, const cl::Buffer& to, std::size_t words) {
  if (words) queue_.enqueueCopyBuffer(from, to, 0, 0, words * sizeof(cl_uint));
}

cl::Kernel& Compute::kernel(const char* name) {
  auto it = kernels_.find(name);
  if (it == kernels_.end()) it = kernels_.emplace(name, cl::Kernel(program_, name)).first;
  return it->second;
}

void Compute::enqueue(const char* name, const cl::Kernel& kernel, std::size_t items, Stage stage) {
  const std::size_t global = (items + local_size - 1) / local_size * local_size;
  cl::Event event;
  queue_.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(global), cl::NDRange(local_size), nullptr, &event);
  running_.push_back({std::move(event), stage, name, items});
  if (running_.size() >= 4096) finish();
}

void Compute::finish() {
  queue_.finish();
  for (const Running& r : running_) {
    const cl_ulong begin = r.event.getProfilingInfo<CL_PROFILING_COMMAND_START>();
    const cl_ulong end = r.event.getProfilingInfo<CL_PROFILING_COMMAND_END>();
    const double seconds = 1e-9 * static_cast<double>(end - begin);
    seconds_[r.stage] += seconds;
    KernelWork& work = table_[{r.stage, r.kernel}];
    ++work.launches;
    work.items += r.items;
    work.seconds += seconds;
  }
  running_.clear();
}

}  // namespace parian
