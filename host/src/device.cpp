// OpenCL's devices: what they are, and which one a selector means.
#include "device.hpp"

#include <CL/opencl.hpp>
#include <algorithm>
#include <tuple>

#include "ascii.hpp"
#include "error.hpp"

namespace parian {
namespace {

std::string trimmed(std::string s) {
  while (!s.empty() && (s.back() == '\0' || ascii::is_space(s.back()))) s.pop_back();
  return s;
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

}  // namespace

std::vector<DeviceInfo> list_devices() {
  std::vector<DeviceInfo> infos;
  for (const auto& d : all_devices()) infos.push_back(d.first);
  return infos;
}

DeviceInfo describe(const cl::Platform& platform, const cl::Device& device) {
  DeviceInfo info;
  info.name = trimmed(device.getInfo<CL_DEVICE_NAME>());
  info.platform = trimmed(platform.getInfo<CL_PLATFORM_NAME>());
  info.vendor = trimmed(device.getInfo<CL_DEVICE_VENDOR>());
  info.driver = trimmed(device.getInfo<CL_DRIVER_VERSION>());
  info.version = trimmed(device.getInfo<CL_DEVICE_VERSION>());
  const cl_device_type type = device.getInfo<CL_DEVICE_TYPE>();
  // What claims to be everything at once simulates it.
  info.type = type & CL_DEVICE_TYPE_CPU ? "CPU" : type & CL_DEVICE_TYPE_GPU ? "GPU" : "accelerator";
  info.compute_units = device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
  // CPU drivers report preferred widths that fit flat kernels; loops over samples want eight lanes everywhere.
  const bool cpu = info.type == "CPU" || ascii::lower(info.name).find("llvmpipe") != std::string::npos;
  info.vector_width = cpu ? 16 : 1;
  info.global_memory = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
  info.max_allocation = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
  info.local_memory = device.getInfo<CL_DEVICE_LOCAL_MEM_SIZE>();
  info.max_work_group = device.getInfo<CL_DEVICE_MAX_WORK_GROUP_SIZE>();
  return info;
}

std::pair<DeviceInfo, cl::Device> pick(const std::string& selector) {
  const auto devices = all_devices();
  if (devices.empty()) throw Error(ErrorKind::device, no_device);
  const bool index = !selector.empty() && std::all_of(selector.begin(), selector.end(), ascii::is_digit);
  std::vector<std::pair<DeviceInfo, cl::Device>> fitting;
  for (const auto& d : devices) {
    const std::string text = ascii::lower(d.first.name + " " + d.first.platform);
    if (selector.empty() || (index && selector.size() < 6 && std::stoul(selector) == d.first.index) ||
        (!index && text.find(ascii::lower(selector)) != std::string::npos))
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

}  // namespace parian
