// Work shared by threads.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>

namespace parian {

/// Calls `work(i)` once for each i below `count` on `threads` threads (0: all processors), in no order. Rethrows the
/// first exception, once all threads have ended.
void in_parallel(std::size_t count, std::uint32_t threads, const std::function<void(std::size_t)>& work);

}  // namespace parian
