// What is known of the machine that a report was measured on.
#include "truth/machine.hpp"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <cstdlib>
#include <fstream>
#include <thread>

#include "core/embedded.hpp"

namespace parian {
namespace {

#ifdef __clang__
constexpr const char* compiler = "Clang " __clang_version__;
#else
constexpr const char* compiler = "GCC " __VERSION__;
#endif

std::string cpu_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (const std::size_t colon = line.find(": "); colon != std::string::npos && line.starts_with("model name"))
      return line.substr(colon + 2);
  return "unknown";
}

}  // namespace

std::array<double, 3> load_averages() {
  std::array<double, 3> load{-1, -1, -1};
  (void)getloadavg(load.data(), 3);  // what isn't known stays negative
  return load;
}

Machine describe_machine(const DeviceInfo& device) {
  Machine machine;
  machine.cpu = cpu_name();
  machine.cores = std::thread::hardware_concurrency();
  utsname system{};
  if (uname(&system) == 0) machine.system = fmt::format("{} {} {}", system.sysname, system.release, system.machine);
  machine.device = device.name;
  machine.platform = device.platform;
  machine.driver = device.driver;
  machine.opencl = device.version;
  machine.compute_units = device.compute_units;
  machine.lanes = device.vector_width;
  machine.version = fmt::format("Parian {}, compiled by {}", version, compiler);
  return machine;
}

}  // namespace parian
