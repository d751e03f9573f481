// The bar, and the lines in its place.
#include "cli/progress.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <system_error>
#include <utility>

#include "cli/terminal.hpp"
#include "io/render_options.hpp"

namespace parian {
namespace {

constexpr double seconds_between_bars = 0.1;
constexpr double seconds_between_lines = 5.0;
// What is compiled already is read in less; the rest is compiled as each kernel is launched.
constexpr double longest_reading = 0.3, longest_silence = 1.0;
constexpr int longest_bar = 24, shortest_bar = 4;
constexpr int usual_columns = 80;

/// Columns of the terminal, asked anew each time, since its window may change.
int terminal_columns() {
  winsize window{};
  if (::ioctl(STDERR_FILENO, TIOCGWINSZ, &window) == 0 && window.ws_col > 0) return window.ws_col;
  const char* told = std::getenv("COLUMNS");
  const auto columns = told ? parse_number(told) : std::nullopt;
  return columns && *columns >= 1 && *columns < 1e6 ? static_cast<int>(*columns) : usual_columns;
}

/// Columns that text takes; wide characters take two.
int columns_of(const std::string& text) {
  const int padded = static_cast<int>(4 * text.size());  // fmt pads to a width in columns
  return padded - static_cast<int>(fmt::formatted_size("{:<{}}", text, padded) - text.size());
}

/// The bar and as much of `text` as fit in one row. The last column stays free: beyond it terminals begin a new row.
std::string fitted_row(double share, std::string text, int columns) {
  const int room = std::max(0, columns - 1);
  const int length = std::min(longest_bar, room - columns_of(text) - 3);
  if (length >= shortest_bar) {
    const int full = static_cast<int>(std::floor(share * length));
    return fmt::format("[{:#<{}}{:.<{}}] {}", "", full, "", length - full, text);
  }
  while (columns_of(text) > room) {
    while ((static_cast<unsigned char>(text.back()) & 0xc0) == 0x80) text.pop_back();  // of one character
    text.pop_back();
  }
  return text;
}

}  // namespace

ProgressBar::ProgressBar(bool shown, std::string unit)
    : unit_(std::move(unit)), shown_(shown), terminal_(isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
  if (drawn_) std::fputs("\r\033[K", stderr);
}

void ProgressBar::update(const Progress& p) {
  if (!shown_) return;
  if (p.seconds - last_ < (terminal_ ? seconds_between_bars : seconds_between_lines)) return;
  last_ = p.seconds;
  const std::string left = p.left >= 0 ? duration(p.left) : std::string("?");
  const std::string estimate = p.error >= 0 ? fmt::format("{:.2g}", p.error) : std::string("?");
  if (terminal_) {
    const std::string text = fmt::format("{} {}  estimated relMSE {}  {} left", unit_, p.frames, estimate, left);
    const std::string row = fitted_row(p.share, printable(text), terminal_columns());
    std::fputs(fmt::format("\r{}\033[K", row).c_str(), stderr);
    std::fflush(stderr);
    drawn_ = true;
  } else {
    say(fmt::format("{} {}, estimated relMSE {}, {} left", unit_, p.frames, estimate, left));
  }
}

void Compiling::step() {
  if (!shown_ || ++steps_ > 2) return;
  if (steps_ == 1) {
    since_.emplace();
    try {
      watcher_ = std::thread([this] { watch(); });
    } catch (const std::system_error&) {  // no thread is to be had: the user waits uninformed
    }
  } else if (since_->seconds() < longest_reading) {
    const std::scoped_lock lock(mutex_);
    stop_ = true;
    stops_.notify_all();
  }
}

void Compiling::watch() {
  std::unique_lock lock(mutex_);
  if (stops_.wait_for(lock, std::chrono::duration<double>(longest_silence), [this] { return stop_; })) return;
  drawn_ = isatty(STDERR_FILENO) == 1;
  const char* what = "compiling kernels (once)";
  if (drawn_) {
    std::fputs(fmt::format("\r{}\033[K", fitted_row(0.0, what, terminal_columns())).c_str(), stderr);
    std::fflush(stderr);
  } else {
    say(what);
  }
}

Compiling::~Compiling() {
  {
    const std::scoped_lock lock(mutex_);
    stop_ = true;
  }
  stops_.notify_all();
  if (watcher_.joinable()) watcher_.join();
  if (drawn_) std::fputs("\r\033[K", stderr);
}

std::string duration(double seconds) {
  if (!(seconds < 1e9)) return "?";
  if (seconds < 60) return fmt::format("{:.1f} s", seconds);
  const long whole = std::lround(seconds);
  if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
  return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
}

}  // namespace parian
