// Wakes a thread. Posting neither blocks nor allocates.
#pragma once

#include <cerrno>
#include <semaphore.h>

namespace kilvo::live {

class Signal {
 public:
  Signal() { sem_init(&semaphore_, 0, 0); }
  ~Signal() { sem_destroy(&semaphore_); }
  Signal(const Signal&) = delete;
  Signal& operator=(const Signal&) = delete;

  void post() { sem_post(&semaphore_); }
  /// Until it has been posted; several posts that nobody waited for wake once.
  void wait() {
    while (sem_wait(&semaphore_) != 0 && errno == EINTR) {
    }
    while (sem_trywait(&semaphore_) == 0) {
    }
  }

 private:
  sem_t semaphore_;
};

}  // namespace kilvo::live
