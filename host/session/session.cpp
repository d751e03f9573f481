// The stopping loop, and the guess at the time left.
#include "session/session.hpp"

#include <algorithm>
#include <optional>

namespace parian {
namespace {

constexpr int checkpoints_below = 2;  // successive estimates below the target, before it stops

/// What stops after these frames, if not the error.
std::optional<StoppedBy> limit_reached(const Stopping& stopping, std::uint32_t frames, double seconds) {
  if (stopping.cancel && stopping.cancel->cancelled()) return StoppedBy::interrupt;
  if (frames >= stopping.frames) return StoppedBy::frames;
  if (stopping.time > 0 && seconds >= stopping.time) return StoppedBy::time;
  return {};
}

}  // namespace

const char* word_of(StoppedBy why) {
  switch (why) {
    case StoppedBy::error:
      return "error";
    case StoppedBy::frames:
      return "frames";
    case StoppedBy::time:
      return "time";
    case StoppedBy::interrupt:
      break;
  }
  return "interrupt";
}

Progress progress_of(const Stopping& stopping, std::uint32_t frames, double error, double seconds) {
  double share = static_cast<double>(frames) / stopping.frames;
  if (stopping.time > 0) share = std::max(share, seconds / stopping.time);
  if (stopping.error > 0 && error > 0) share = std::max(share, stopping.error / error);
  share = std::clamp(share, 0.0, 1.0);
  return {frames, error, seconds, share, share > 0 ? seconds * (1 - share) / share : -1.0};
}

StoppedBy render_frames(FrameSource& source, const Stopping& stopping,
                        const std::function<void(const Progress&)>& on_frame) {
  const Clock clock;
  double error = -1;
  int below = 0;
  for (std::uint32_t frames = 1;; ++frames) {
    source.frame();
    const bool estimated = stopping.checkpoints && source.estimate_due();
    if (estimated) {
      error = source.estimate();
      below = error >= 0 && error < stopping.error ? below + 1 : 0;
    }
    const double seconds = clock.seconds();
    if (on_frame) on_frame(progress_of(stopping, frames, error, seconds));
    if (below >= checkpoints_below) return StoppedBy::error;
    const std::optional<StoppedBy> why = limit_reached(stopping, frames, seconds);
    if (!why) continue;
    if (!estimated) source.estimate();  // so that the pictures show the pyramid level that is best now
    return *why;
  }
}

}  // namespace parian
