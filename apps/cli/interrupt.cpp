#include "apps/cli/interrupt.hpp"

#include <ctime>

namespace kilvo::cli {

InterruptWatch::InterruptWatch() {
  sigemptyset(&watched_);
  sigaddset(&watched_, SIGINT);
  sigaddset(&watched_, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &watched_, &before_);
}

InterruptWatch::~InterruptWatch() {
  requested();  // a signal that came last is answered by what was just written
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

bool InterruptWatch::requested() {
  if (requested_) return true;
  const timespec at_once{};
  if (sigtimedwait(&watched_, nullptr, &at_once) < 0) return false;
  requested_ = true;
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  return true;
}

bool InterruptWatch::poll() {
  constexpr unsigned period = 64;
  return ++polls_ % period == 0 && requested();
}

}  // namespace kilvo::cli
