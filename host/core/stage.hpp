// What time is booked on.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <utility>

namespace parian {

/// The stages of a render; the names are those of Seconds.
enum class Stage { plan, light_map, layers, pyramids, gather, bias };

/// What a kernel has done so far: launches, work-items without padding, and seconds by events.
struct KernelWork {
  std::uint64_t launches = 0, items = 0;
  double seconds = 0.0;
};
using KernelTable = std::map<std::pair<Stage, std::string>, KernelWork>;

}  // namespace parian
