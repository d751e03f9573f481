// Threads that take one item after the other until none is left.
#include "core/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace parian {

void in_parallel(std::size_t count, std::uint32_t threads, const std::function<void(std::size_t)>& work) {
  if (threads == 0) threads = std::max(1U, std::thread::hardware_concurrency());
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex mutex;
  const auto run = [&] {
    try {
      for (std::size_t i = next++; i < count; i = next++) work(i);
    } catch (...) {
      next = count;
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  std::vector<std::jthread> others;
  try {
    for (std::uint32_t t = 1; t < threads && t < count; ++t) others.emplace_back(run);
  } catch (const std::system_error&) {  // no more threads: those that there are do it
  }
  run();
  others.clear();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace parian
