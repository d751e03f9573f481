// `parian devices`: what OpenCL offers, and how each device answers the self-test.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "cli/driver_guard.hpp"
#include "cli/terminal.hpp"
#include "core/drivers.hpp"
#include "core/words.hpp"
#include "plan/plan.hpp"
#include "render/self_test.hpp"
#include "session/program_folder.hpp"
#include "truth/child_process.hpp"
#include "truth/trial.hpp"

namespace parian {
namespace {

using Json = nlohmann::ordered_json;

constexpr double patience = 120;  // seconds for a device to compile the kernels and to answer

Json json_of(const DeviceInfo& device) {
  return {{"index", device.index},
          {"name", device.name},
          {"platform", device.platform},
          {"vendor", device.vendor},
          {"driver", device.driver},
          {"version", device.version},
          {"type", device.type},
          {"compute_units", device.compute_units},
          {"vector_width", device.vector_width},
          {"max_work_group", device.max_work_group},
          {"global_memory", device.global_memory},
          {"max_allocation", device.max_allocation},
          {"local_memory", device.local_memory}};
}

/// What a device fails in: {"check", "found"} each; empty when it's sound.
Json failures_of(const std::string& selector) {
  Json failed = Json::array();
  try {
    Compute compute(selector);
    const Plan plan = make_plan(ordinary_scene(), ordinary_settings(), compute.info());
    keep_programs(compute);
    for (const SelfTestAnswer& a :
         with_device_errors(compute.info(), [&] { return self_test(compute, ordinary_settings().model, plan.lanes); }))
      if (!a.passed) failed.push_back({{"check", a.name}, {"found", a.found}});
  } catch (const Error& error) {
    failed.push_back({{"check", "run"}, {"found", in_command_words(error.what())}});
  }
  return failed;
}

std::string line(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n'; }

/// What OpenCL offers: "devices"; "remarks" on drivers that offer none; "none", which says why, where there are none.
Json offer() {
  Json found{{"devices", Json::array()}, {"remarks", Json::array()}, {"none", ""}};
  try {
    for (const DeviceInfo& device : list_devices()) found["devices"].push_back(json_of(device));
    if (found["devices"].empty()) found["none"] = why_no_device();
    for (const std::string& remark : driver_remarks()) found["remarks"].push_back(remark);
  } catch (const Error& error) {
    found["none"] = error.what();
  }
  return found;
}

/// Which driver ends a process that asks for devices, if one does so by itself; and what to do.
std::string culprit(const std::string& trouble) {
  const RegisteredDrivers registered = registered_drivers();
  std::string who = "a driver", ended = trouble, remedy = memory_limit() > 0 ? memory_remedy() + ", or " : "";
  for (const Driver& driver : registered.drivers) {
    if (!driver.place.ends_with(".icd")) continue;
    const ChildOutcome outcome = in_child_process(patience, [&](const auto& tell) {
      unguard_drivers();
      setenv("OCL_ICD_VENDORS", driver.place.c_str(), 1);
      (void)list_devices();
      tell("done");
    });
    if (outcome.told == "done") continue;
    who = driver.name();
    ended = outcome.trouble;
    break;
  }
  if (registered.drivers.size() > 1) remedy += "name another's .icd file in OCL_ICD_VENDORS, or ";
  return fmt::format("{} fails when it is asked for its devices: {}; {}update that driver", who, ended, remedy);
}

/// Asks all devices, each in a process of its own: a driver that hangs or crashes is in the list like any other.
Json survey() {
  Json found;
  for (std::size_t i = 0; i == 0 || i < found["devices"].size(); ++i) {
    const ChildOutcome outcome = in_child_process(patience, [&](const auto& tell) {
      unguard_drivers();
      const Json all = offer();
      tell(line(all));
      if (i < all["devices"].size()) tell(line(failures_of(std::to_string(i))));
    });
    const std::size_t end = outcome.told.find('\n');
    if (end == std::string::npos) throw Error(ErrorKind::device, culprit(outcome.trouble));
    if (i == 0) found = Json::parse(outcome.told.substr(0, end));
    if (found["devices"].empty()) break;
    Json& device = found["devices"][i];
    const std::string answer = outcome.told.substr(end + 1);
    const bool pocl = device["platform"] == "Portable Computing Language";
    const std::string crash = outcome.trouble + "; " + crash_remedy(pocl ? Culprit::pocl : Culprit::other);
    const Json failed = answer.ends_with('\n') ? Json::parse(answer) : Json{{{"check", "run"}, {"found", crash}}};
    device["self_test"] = {{"passed", failed.empty()}, {"failed", failed}};
  }
  return found;
}

void print_list(const Json& devices) {
  const auto text = [](const Json& device, const char* key) { return device[key].get<std::string>(); };
  const auto size = [](const Json& device, const char* key, int shift) {
    return static_cast<double>(device[key].get<std::uint64_t>()) / static_cast<double>(1U << shift);
  };
  for (const Json& d : devices) {
    show("{:>2}  {} ({}), {}\n", d["index"].get<int>(), text(d, "name"), text(d, "platform"), text(d, "type"));
    show("    {}, driver {}\n", text(d, "version"), text(d, "driver"));
    show("    {} compute units, {} lanes, work-groups of up to {}\n", d["compute_units"].get<std::uint64_t>(),
         d["vector_width"].get<std::uint64_t>(), d["max_work_group"].get<std::uint64_t>());
    show("    {:.1f} GiB of memory, {:.1f} GiB in one buffer, {:.0f} KiB in a work-group\n",
         size(d, "global_memory", 30), size(d, "max_allocation", 30), size(d, "local_memory", 10));
    show("    self-test {}\n", d["self_test"]["passed"].get<bool>() ? "passed" : "failed");
    for (const Json& f : d["self_test"]["failed"]) show("      {}: {}\n", text(f, "check"), text(f, "found"));
  }
}

}  // namespace

void add_devices(CLI::App& app, Run& run) {
  CLI::App* command =
      app.add_subcommand("devices", "list OpenCL devices and test each; the number is what --device takes");
  const auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "as JSON");
  command->callback([&run, json] {
    run = [json] {
      const std::string told = guard_drivers();
      const Json found = survey();
      const Json& devices = found["devices"];
      if (*json) show_text(devices.dump(2, ' ', true) + "\n");
      if (devices.empty()) throw Error(ErrorKind::device, found["none"].get<std::string>());
      if (!*json) print_list(devices);
      flush_results();
      for (const Json& remark : found["remarks"]) say(remark.get<std::string>());
      if (!told.empty()) say(told);
      return 0;
    };
  });
}

}  // namespace parian
