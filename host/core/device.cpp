// OpenCL's devices: what they are, and which one a selector means.
#include "core/device.hpp"

#include <fmt/format.h>

#include <CL/opencl.hpp>
#include <algorithm>
#include <cstdlib>

#include "core/ascii.hpp"
#include "core/drivers.hpp"
#include "core/error.hpp"

namespace parian {
namespace {

std::string trimmed(std::string s) {
  while (!s.empty() && (s.back() == '\0' || ascii::is_space(s.back()))) s.pop_back();
  return s;
}

bool is_number(const std::string& selector) {
  return !selector.empty() && std::all_of(selector.begin(), selector.end(), ascii::is_digit);
}

/// Khronos's loader reads that variable; ocl-icd, of Debian and others, doesn't.
bool is_named_for_one_loader(const Driver& driver) { return driver.place == "OCL_ICD_FILENAMES"; }

constexpr const char* pocl = "Portable Computing Language";

/// What OpenCL offers.
struct Offer {
  std::vector<std::pair<DeviceInfo, cl::Device>> devices;
  std::vector<std::pair<std::string, cl_int>> bare;  ///< platforms without a device, and what they said
  cl_int code = CL_SUCCESS;                          ///< what the loader said
};

/// The code that `f` fails with, as a call of OpenCL.
template <class F>
cl_int code_of(F&& f) {
  try {
    f();
    return CL_SUCCESS;
  } catch (const cl::Error& error) {
    return error.err();
  }
}

/// All devices that can compile kernels, and the platforms that have none.
Offer offer() {
  if (const Trouble t = pocl_would_abort(); !t.what.empty()) throw Error(ErrorKind::device, t.what + "; " + t.remedy);
  Offer found;
  std::vector<cl::Platform> platforms;
  found.code = code_of([&] { cl::Platform::get(&platforms); });
  for (const cl::Platform& platform : platforms) {
    const std::size_t before = found.devices.size();
    const cl_int code = code_of([&] {
      std::vector<cl::Device> devices;
      platform.getDevices(CL_DEVICE_TYPE_ALL, &devices);
      for (const cl::Device& device : devices) {
        if (!device.getInfo<CL_DEVICE_AVAILABLE>() || !device.getInfo<CL_DEVICE_COMPILER_AVAILABLE>()) continue;
        found.devices.emplace_back(describe(platform, device), device);
        found.devices.back().first.index = static_cast<std::uint32_t>(found.devices.size() - 1);
      }
    });
    if (found.devices.size() > before) continue;
    std::string name = "a platform without a name";
    code_of([&] { name = trimmed(platform.getInfo<CL_PLATFORM_NAME>()); });
    found.bare.emplace_back(name, code);
  }
  return found;
}

/// Why a platform has no device.
Trouble platform_trouble(const std::string& name, cl_int code) {
  if (name == pocl)
    if (const Trouble t = pocl_cache_trouble(); !t.what.empty()) return {t.what, t.remedy, name + " PoCL"};
  const std::string none = fmt::format("the platform {} has no device", name);
  if (code == CL_OUT_OF_HOST_MEMORY || memory_limit() > 0) return {none, memory_remedy(), name};
  if (name == "rusticl" && !std::getenv("RUSTICL_ENABLE"))
    return {none + ", since RUSTICL_ENABLE isn't set",
            "set RUSTICL_ENABLE to a driver of Mesa's, such as radeonsi, iris, nouveau or, for the CPU, llvmpipe",
            name};
  return {none, get_a_driver, name};
}

/// What keeps drivers from offering a device.
std::vector<Trouble> troubles_of(const Offer& offered) {
  const RegisteredDrivers registered = registered_drivers();
  std::vector<Trouble> all;
  for (const Driver& driver : registered.drivers) all.push_back(driver_trouble(driver));
  for (const auto& [name, code] : offered.bare) all.push_back(platform_trouble(name, code));
  if (std::any_of(all.begin(), all.end(), [](const Trouble& t) { return t.remedy == get_a_driver; }))
    all.push_back(device_file_trouble());
  std::erase_if(all, [](const Trouble& t) { return t.what.empty(); });
  return all;
}

/// All of `troubles` in one line, each remedy once. Who has PoCL needn't install it.
std::string in_one_line(const std::vector<Trouble>& troubles) {
  const bool other =
      std::any_of(troubles.begin(), troubles.end(), [](const Trouble& t) { return t.remedy != get_a_driver; });
  std::vector<std::string> whats, remedies;
  for (const Trouble& t : troubles) {
    whats.push_back(t.what);
    if (std::find(remedies.begin(), remedies.end(), t.remedy) == remedies.end() &&
        !(other && t.remedy == get_a_driver && has_pocl(registered_drivers())))
      remedies.push_back(t.remedy);
  }
  return fmt::format("{}; {}", fmt::join(whats, ", and "), fmt::join(remedies, ", or "));
}

std::string why_none(const Offer& offered) {
  const std::string begin = "there is no OpenCL device: ";
  std::vector<Trouble> all = troubles_of(offered);
  const RegisteredDrivers registered = registered_drivers();
  if (std::all_of(registered.drivers.begin(), registered.drivers.end(), is_named_for_one_loader))
    all.insert(all.begin(), registered.none);
  if (!all.empty()) return begin + in_one_line(all);
  const std::string what = fmt::format("no driver offers one (the loader says {})", offered.code);
  return begin + in_one_line({{what, memory_limit() > 0 ? memory_remedy() : get_a_driver, {}}});
}

/// Why there is no device of that name or number: its driver's trouble, if that is known.
std::string why_not(const std::string& selector, const Offer& offered) {
  std::vector<Trouble> its = troubles_of(offered);
  const std::string name = ascii::lower(selector);
  std::erase_if(its, [&](const Trouble& t) { return ascii::lower(t.of).find(name) == std::string::npos; });
  const std::string begin = "device '" + selector + "': ";
  return begin +
         (is_number(selector) || its.empty() ? "no such OpenCL device; see 'parian devices'" : in_one_line(its));
}

}  // namespace

std::vector<DeviceInfo> list_devices() {
  std::vector<DeviceInfo> infos;
  for (const auto& d : offer().devices) infos.push_back(d.first);
  return infos;
}

std::vector<std::string> driver_remarks() {
  std::vector<std::string> remarks;
  for (const Trouble& t : troubles_of(offer())) remarks.push_back(t.what + "; " + t.remedy);
  return remarks;
}

std::string why_no_device() { return why_none(offer()); }

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
  const Offer offered = offer();
  if (offered.devices.empty()) throw Error(ErrorKind::device, why_none(offered));
  const bool index = is_number(selector);
  std::vector<std::pair<DeviceInfo, cl::Device>> fitting;
  for (const auto& d : offered.devices) {
    const std::string text = ascii::lower(d.first.name + " " + d.first.platform);
    if (selector.empty() || (index && selector.size() < 6 && std::stoul(selector) == d.first.index) ||
        (!index && text.find(ascii::lower(selector)) != std::string::npos))
      fitting.push_back(d);
  }
  if (fitting.empty()) throw Error(ErrorKind::device, why_not(selector, offered));
  const auto rank = [](const DeviceInfo& i) {
    return std::pair(i.type == "GPU" ? 2 : i.type == "accelerator" ? 1 : 0, i.compute_units);
  };
  auto picked = *std::max_element(fitting.begin(), fitting.end(),
                                  [&](const auto& a, const auto& b) { return rank(a.first) < rank(b.first); });
  require_kernel_cache(picked.first);
  return picked;
}

void require_kernel_cache(const DeviceInfo& device) {
  if (device.platform != pocl) return;
  const Trouble t = pocl_cache_trouble();
  if (!t.what.empty()) throw Error(ErrorKind::device, device.name + ": " + t.what + "; " + t.remedy);
}

}  // namespace parian
