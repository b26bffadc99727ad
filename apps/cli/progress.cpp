#include "apps/cli/progress.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <unistd.h>

namespace kilvo::cli {
namespace {

std::string remaining_text(double elapsed, double fraction) {
  if (fraction < 0.01) return "";
  const auto seconds = static_cast<int>(std::ceil(elapsed * (1 - fraction) / fraction));
  return seconds < 60 ? fmt::format("{} s left", seconds) : fmt::format("{}:{:02} min left", seconds / 60, seconds % 60);
}

}  // namespace

Progress::Style Progress::style_for(bool quiet) {
  if (quiet) return Style::none;
  return isatty(STDERR_FILENO) != 0 ? Style::bar : Style::lines;
}

void Progress::show(double fraction, const std::string& note, Clock::time_point now) {
  fraction = std::clamp(fraction, 0.0, 1.0);
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const std::string remaining = remaining_text(elapsed, fraction);
  if (style_ == Style::bar) {
    constexpr int width = 30;
    const auto filled = static_cast<std::size_t>(std::lround(width * fraction));
    // Back to the beginning of the line, and clear what an earlier, longer text left behind.
    fmt::print(stderr, "\r[{}{}] {:3.0f} %  {}  {}\x1b[K", std::string(filled, '#'), std::string(width - filled, '.'), 100 * fraction,
               remaining, note);
    next_ = now + bar_period;
    bar_shown_ = true;
  } else {
    fmt::print(stderr, "kilvo: {:.0f} %, {}{}{}\n", 100 * fraction, remaining, remaining.empty() ? "" : ", ", note);
    next_ = now + line_period;
  }
  std::fflush(stderr);
}

void Progress::finish() {
  if (bar_shown_) fmt::print(stderr, "\r\x1b[K");
  bar_shown_ = false;
}

}  // namespace kilvo::cli
