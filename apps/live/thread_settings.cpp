#include "apps/live/thread_settings.hpp"

#include <algorithm>
#include <cstring>
#include <ctime>
#include <pthread.h>
#include <sched.h>

namespace kilvo::live {

std::string settle_thread(const ThreadSettings& settings) {
  std::string out;
  pthread_setname_np(pthread_self(), settings.name);
  if (settings.priority != 0) {
    sched_param parameters{};
    parameters.sched_priority = std::max(1, settings.priority);
    const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
    if (error != 0 && settings.priority > 0) out += std::string(settings.name) + ": no real-time priority (" + std::strerror(error) + "); ";
  }
  if (settings.core >= 0) {
    cpu_set_t cores;
    CPU_ZERO(&cores);
    if (settings.core < CPU_SETSIZE) CPU_SET(static_cast<std::size_t>(settings.core), &cores);
    if (const int error = pthread_setaffinity_np(pthread_self(), sizeof cores, &cores); error != 0)
      out += std::string(settings.name) + ": not bound to core " + std::to_string(settings.core) + " (" + std::strerror(error) + "); ";
  }
  return out.empty() ? out : out.substr(0, out.size() - 2);
}

double thread_cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace kilvo::live
