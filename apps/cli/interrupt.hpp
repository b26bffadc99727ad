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
  /// For each message: the question costs a system call, half as much as a leg sample, and is asked at each 64th call only.
  bool poll();

 private:
  sigset_t watched_{}, before_{};
  unsigned polls_ = 0;
  bool requested_ = false;
};

}  // namespace kilvo::cli
