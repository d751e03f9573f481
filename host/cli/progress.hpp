// Progress on standard error: a bar on a terminal, else a line every few seconds.
#pragma once
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "scene.hpp"

namespace parian {

/// Wall seconds since it was made.
class Clock {
 public:
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

class Progress {
 public:
  /// `shown` is false for --quiet: then nothing is printed. `unit` is what is counted.
  Progress(const Settings& settings, bool shown, std::string unit = "frame");
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Tells how far it is: frames done, the estimated relMSE (negative: not known) and seconds since the first frame.
  void update(std::uint32_t frames, double error, double seconds);
  /// Removes the bar, so that other lines can follow.
  void clear();

 private:
  Settings settings_;
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
