// A render from the first frame until something says stop, whoever shows it. Nothing here prints.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>

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

/// A request to stop after the frame that is under way. Any thread may make it, and any handler of signals.
class CancelToken {
 public:
  void cancel() noexcept { cancelled_ = true; }
  [[nodiscard]] bool cancelled() const noexcept { return cancelled_; }

 private:
  std::atomic<bool> cancelled_{false};
  static_assert(std::atomic<bool>::is_always_lock_free, "handlers of signals may not wait");
};

/// When to stop: whatever comes first.
struct Stopping {
  double error = 0.0;                                                ///< two estimates in a row below it; 0: never
  std::uint32_t frames = std::numeric_limits<std::uint32_t>::max();  ///< after as many
  double time = 0.0;                                                 ///< wall seconds from the first frame; 0: never
  const CancelToken* cancel = nullptr;                               ///< may be null
  bool checkpoints = true;  ///< whether to estimate the error when the renderer says; false: after the last frame alone
};

enum class StoppedBy { error, frames, time, interrupt };
/// As Statistics::stopped_by has it.
[[nodiscard]] const char* word_of(StoppedBy why);

/// How far a render is.
struct Progress {
  std::uint32_t frames = 0;  ///< done
  double error = -1.0;       ///< the estimated relMSE; negative: not known
  double seconds = 0.0;      ///< wall, since the first frame began
  double share = 0.0;        ///< of the work, from 0 to 1, by the limit that is nearest
  double left = -1.0;        ///< wall seconds, a guess; negative: not known
};

/// The same with its guesses, from what is known. The error falls as one over the frames.
[[nodiscard]] Progress progress_of(const Stopping& stopping, std::uint32_t frames, double error, double seconds);

/// What makes frames, and estimates the error of their mean.
class FrameSource {
 public:
  virtual void frame() = 0;
  [[nodiscard]] virtual bool estimate_due() const = 0;
  /// The estimated relMSE; negative: not known. It may choose what pictures show.
  virtual double estimate() = 0;

 protected:
  ~FrameSource() = default;
};

/// Renders at least one frame, and until `stopping` says stop; calls `on_frame` after each, before it asks whether that
/// was the last. Pictures may be read afterwards: what they show is estimated. Throws what `source` and `on_frame` do.
StoppedBy render_frames(FrameSource& source, const Stopping& stopping,
                        const std::function<void(const Progress&)>& on_frame = {});

}  // namespace parian
