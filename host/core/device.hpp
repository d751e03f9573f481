// OpenCL's devices: what is known of each, and the choice of one.
#pragma once
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace cl {
class Device;
class Platform;
}  // namespace cl

namespace parian {

/// An OpenCL device as `parian devices` lists it.
struct DeviceInfo {
  std::uint32_t index = 0;  ///< what --device N takes
  std::string name, platform, vendor, driver, version, type;
  std::uint32_t compute_units = 0;
  std::uint32_t vector_width = 0;                                         ///< lanes Parian uses: 16 on CPUs, 1 on GPUs
  std::uint64_t global_memory = 0, max_allocation = 0, local_memory = 0;  ///< bytes
  std::uint64_t max_work_group = 0;
};

/// All devices of all platforms, in the order that the ICD loader gives them; empty when there is none.
[[nodiscard]] std::vector<DeviceInfo> list_devices();

/// What keeps registered drivers from offering a device, a message each. Loads them all.
[[nodiscard]] std::vector<std::string> driver_remarks();

/// Why there is no device, on a machine that has none, and what to do: one message.
[[nodiscard]] std::string why_no_device();

/// What a device of `platform` says of itself; its index is 0. Throws cl::Error.
[[nodiscard]] DeviceInfo describe(const cl::Platform& platform, const cl::Device& device);

/// The device that `selector` means, as Renderer describes it. Throws Error(device) where there is none, with the
/// reason, and as require_kernel_cache() does.
[[nodiscard]] std::pair<DeviceInfo, cl::Device> pick(const std::string& selector);

/// Throws Error(device) where a device is PoCL's, and PoCL can't keep compiled kernels, without which it builds none.
void require_kernel_cache(const DeviceInfo& device);

}  // namespace parian
