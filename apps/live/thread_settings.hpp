// What the operating system is asked of the calling thread.
#pragma once

#include <string>

namespace kilvo::live {

struct ThreadSettings {
  const char* name = "";  // at most 15 characters
  int priority = 0;       // SCHED_FIFO, 1 to 99; 0: as all others; -1: 1, and nothing is reported if that cannot be had
  int core = -1;          // the only one to run on; -1: any
};

/// What could not be had, as a sentence for the user; empty when all was.
std::string settle_thread(const ThreadSettings& settings);

/// CPU time of the calling thread so far, s.
double thread_cpu_seconds();

}  // namespace kilvo::live
