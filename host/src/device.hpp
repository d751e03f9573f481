// What is known of an OpenCL device.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace parian {

/// An OpenCL device as `parian devices` lists it.
struct DeviceInfo {
  std::uint32_t index = 0;  ///< what --device N takes
  std::string name, platform, vendor, driver, version, type;
  std::uint32_t compute_units = 0;
  std::uint32_t vector_width = 0;                       ///< lanes Parian uses: 8 on CPUs, 1 on GPUs
  std::uint64_t global_memory = 0, max_allocation = 0;  ///< bytes
};

/// All devices of all platforms, in the order that the ICD loader gives them; empty when there is none.
[[nodiscard]] std::vector<DeviceInfo> list_devices();

}  // namespace parian
