// The bar, and the guess at the time left.
#include "progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace parian {
namespace {

constexpr double seconds_between_bars = 0.1;
constexpr double seconds_between_lines = 5.0;
constexpr int bar_length = 24;

/// Share of the work done: whichever limit is nearest. The error falls as one over the frames.
double share_done(const Settings& settings, std::uint32_t frames, double error, double seconds) {
  double share = static_cast<double>(frames) / settings.frames;
  if (settings.time > 0) share = std::max(share, seconds / settings.time);
  if (settings.error > 0 && error > 0) share = std::max(share, settings.error / error);
  return std::clamp(share, 0.0, 1.0);
}

}  // namespace

Progress::Progress(const Settings& settings, bool shown, std::string unit)
    : settings_(settings), unit_(std::move(unit)), shown_(shown), terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (drawn_) std::fputs("\r\033[K", stderr);
}

void Progress::update(std::uint32_t frames, double error, double seconds) {
  if (!shown_) return;
  if (seconds - last_ < (terminal_ ? seconds_between_bars : seconds_between_lines)) return;
  last_ = seconds;
  const double share = share_done(settings_, frames, error, seconds);
  const std::string left = share > 0 ? duration(seconds * (1 - share) / share) : std::string("?");
  const std::string estimate = error >= 0 ? fmt::format("{:.2g}", error) : std::string("?");
  if (terminal_) {
    const int full = static_cast<int>(std::floor(share * bar_length));
    fmt::print(stderr, "\r[{:#<{}}{:.<{}}] {} {}  estimated relMSE {}  {} left\033[K", "", full, "", bar_length - full,
               unit_, frames, estimate, left);
    std::fflush(stderr);
    drawn_ = true;
  } else {
    fmt::print(stderr, "parian: {} {}, estimated relMSE {}, {} left\n", unit_, frames, estimate, left);
  }
}

void Progress::clear() {
  if (drawn_) std::fputs("\r\033[K", stderr);
  drawn_ = false;
}

std::string duration(double seconds) {
  if (!(seconds < 1e9)) return "?";
  if (seconds < 60) return fmt::format("{:.1f} s", seconds);
  const long whole = std::lround(seconds);
  if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
  return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
}

}  // namespace parian
