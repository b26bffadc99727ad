// Ctrl-C and `kill` as a question that the main loop asks, instead of a handler that may touch nothing but globals.
#pragma once

#include <csignal>

namespace kilvo::cli {

/// While it lives, SIGINT and SIGTERM wait. Once one has been noticed they act as usual again: a second one ends the program at once.
class InterruptWatch {
 public:
  InterruptWatch();
  ~InterruptWatch();
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;

  bool requested();

 private:
  sigset_t watched_{}, before_{};
  bool requested_ = false;
};

}  // namespace kilvo::cli
