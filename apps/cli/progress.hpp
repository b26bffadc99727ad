// How far the work is, on stderr: a bar on a terminal, a line every 5 s otherwise.
#pragma once

#include <chrono>
#include <string>

namespace kilvo::cli {

class Progress {
 public:
  enum class Style { none, lines, bar };

  /// `quiet`: nothing at all. Otherwise a bar when stderr is a terminal.
  static Style style_for(bool quiet);

  explicit Progress(Style style) : style_(style) {}
  ~Progress() { finish(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `fraction` of the work done, `note` for the end of the line. Cheap when nothing is due.
  template <class Note>
  void update(double fraction, Note&& note) {
    if (style_ == Style::none) return;
    const auto now = Clock::now();
    if (now < next_) return;
    show(fraction, note(), now);
  }

  /// Clears the bar, so that what is printed next starts on a clean line.
  void finish();

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds bar_period{100};
  static constexpr std::chrono::seconds line_period{5};

  void show(double fraction, const std::string& note, Clock::time_point now);

  Style style_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point next_ =
      start_ + (style_ == Style::bar ? std::chrono::milliseconds(bar_period) : std::chrono::milliseconds(line_period));
  bool bar_shown_ = false;
};

}  // namespace kilvo::cli
