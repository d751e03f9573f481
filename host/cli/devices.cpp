// `parian devices`: what OpenCL offers.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "renderer.hpp"

namespace parian {
namespace {

using Json = nlohmann::ordered_json;

void print_json(const std::vector<DeviceInfo>& devices) {
  Json list = Json::array();
  for (const DeviceInfo& device : devices) {
    list.push_back({{"index", device.index},
                    {"name", device.name},
                    {"platform", device.platform},
                    {"vendor", device.vendor},
                    {"driver", device.driver},
                    {"version", device.version},
                    {"type", device.type},
                    {"compute_units", device.compute_units},
                    {"vector_width", device.vector_width},
                    {"global_memory", device.global_memory},
                    {"max_allocation", device.max_allocation}});
  }
  fmt::print("{}\n", list.dump(2, ' ', false, Json::error_handler_t::replace));
}

void print_table(const std::vector<DeviceInfo>& devices) {
  std::size_t name = 4, platform = 8, type = 4;
  for (const DeviceInfo& device : devices) {
    name = std::max(name, device.name.size());
    platform = std::max(platform, device.platform.size());
    type = std::max(type, device.type.size());
  }
  fmt::print("{:>3}  {:<{}}  {:<{}}  {:<{}}  {:>5}  {:>5}  {:>7}  {}\n", "", "name", name, "platform", platform, "type",
             type, "units", "lanes", "GiB", "version");
  for (const DeviceInfo& device : devices) {
    fmt::print("{:>3}  {:<{}}  {:<{}}  {:<{}}  {:>5}  {:>5}  {:>7.1f}  {}\n", device.index, device.name, name,
               device.platform, platform, device.type, type, device.compute_units, device.vector_width,
               static_cast<double>(device.global_memory) / (1u << 30), device.version);
  }
}

}  // namespace

void add_devices(CLI::App& app, Run& run) {
  CLI::App* command = app.add_subcommand("devices", "list OpenCL devices; the number is what --device takes");
  const auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "as JSON");
  command->callback([&run, json] {
    run = [json] {
      const std::vector<DeviceInfo> devices = list_devices();
      if (*json) print_json(devices);
      if (devices.empty()) {
        throw Error(ErrorKind::device, "there is no OpenCL device; install a driver, such as PoCL for CPUs");
      }
      if (!*json) print_table(devices);
      return 0;
    };
  });
}

}  // namespace parian
