// Progress on standard error: a bar on a terminal, else a line every few seconds.
#pragma once
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "session/session.hpp"

namespace parian {

class ProgressBar {
 public:
  /// `shown` is false for --quiet: then nothing is printed. `unit` is what is counted.
  explicit ProgressBar(bool shown, std::string unit = "frame");
  /// Removes the bar, so that other lines can follow.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void update(const Progress& progress);

 private:
  std::string unit_;
  bool shown_, terminal_;
  bool drawn_ = false;
  double last_ = 0.0;  ///< when something was printed, in seconds since the first frame
};

/// Says "compiling kernels (once)" while a renderer plans, where the driver takes more than a second for it.
class Compiling {
 public:
  /// `shown` is false for --quiet: then nothing is printed.
  explicit Compiling(bool shown) : shown_(shown) {}
  /// Removes the bar, so that other lines can follow.
  ~Compiling();
  Compiling(const Compiling&) = delete;
  Compiling& operator=(const Compiling&) = delete;

  /// To be called before kernels are compiled, and before each launch.
  void step();

 private:
  void watch();

  bool shown_;
  std::optional<Clock> since_;  ///< the compiler began, until it is known not to take long
  int steps_ = 0;
  std::mutex mutex_;
  std::condition_variable stops_;
  bool stop_ = false, drawn_ = false;
  std::thread watcher_;
};

/// A duration for people, such as "3.2 s" or "2 min 5 s".
[[nodiscard]] std::string duration(double seconds);

}  // namespace parian
