// OpenCL's drivers as they are registered with its loader, and what keeps one from offering a device. Linux only: other
// systems register drivers in other ways, and nothing is known of them here.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace parian {

/// What is wrong, and what to do about it: clauses of a message, in one line.
struct Trouble {
  std::string what, remedy;
  std::string of;  ///< names that a user may call the driver by, if it's one driver's
};

/// How to get a driver where there is none.
inline constexpr const char* get_a_driver =
    "install your GPU's driver, or PoCL to run on the CPU (Debian and Ubuntu: apt install pocl-opencl-icd)";

/// A driver as it is registered.
struct Driver {
  std::string place;    ///< the .icd file, or the variable of the environment that names the library
  std::string library;  ///< as dlopen() takes it; empty where the file names none
  std::string trouble;  ///< why the file can't be read; empty if it can

  /// As a subject: "libx.so, which /etc/OpenCL/vendors/x.icd names,".
  [[nodiscard]] std::string name() const;
};

/// What the loader finds.
struct RegisteredDrivers {
  std::vector<Driver> drivers;
  Trouble none;  ///< where there are none: why
};

/// Reads the folder of .icd files, or what OCL_ICD_VENDORS, OPENCL_VENDOR_PATH and OCL_ICD_FILENAMES name instead, as
/// the loaders do. Loads no driver.
[[nodiscard]] RegisteredDrivers registered_drivers();

/// Why `driver` offers no platform; empty if it does. Loads it.
[[nodiscard]] Trouble driver_trouble(const Driver& driver);

/// Device files of GPUs that this user may not open; empty if there are none.
[[nodiscard]] Trouble device_file_trouble();

/// What this process's memory is limited to, in bytes; 0 if it isn't.
[[nodiscard]] std::uint64_t memory_limit();
/// What to do where a driver lacks memory.
[[nodiscard]] std::string memory_remedy();

/// Whether PoCL is among the registered drivers.
[[nodiscard]] bool has_pocl(const RegisteredDrivers& registered);

/// Where PoCL keeps compiled kernels.
struct PoclCache {
  std::string folder;
  std::string source;  ///< the variable that says so; empty where none does, and the folder is anyone's
};
[[nodiscard]] PoclCache pocl_cache();

/// Why no library can be made in `folder`, which may be to be made itself, and loaded from it, as PoCL does with each
/// kernel; empty if it can.
[[nodiscard]] std::string kernel_folder_trouble(const std::string& folder);

/// The same of PoCL's cache.
[[nodiscard]] Trouble pocl_cache_trouble();

/// Why PoCL would abort this process when it is asked for its devices, where that can be foreseen; empty otherwise.
[[nodiscard]] Trouble pocl_would_abort();

/// Whether hwloc, which PoCL asks, has no sysfs to look at, and nothing in its place.
[[nodiscard]] bool hwloc_is_blind();

}  // namespace parian
