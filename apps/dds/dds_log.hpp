// What Cyclone DDS itself reports: one line of a kind in ten seconds, however often it says it. A publisher of garbage is reported so with
// every message that it sends.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <mutex>
#include <string>

namespace kilvo::dds {

class DdsLog {
 public:
  /// From its beginning to its end; one at a time. `say` may be called by any thread.
  explicit DdsLog(std::function<void(const std::string&)> say);
  ~DdsLog();
  DdsLog(const DdsLog&) = delete;
  DdsLog& operator=(const DdsLog&) = delete;

  /// A line, as it comes from Cyclone DDS.
  void take(const std::string& line);

 private:
  struct Kind {
    std::chrono::steady_clock::time_point last{};
    std::uint64_t left_out = 0;
  };

  std::function<void(const std::string&)> say_;
  std::mutex mutex_;
  std::map<std::string, Kind> kinds_;  // by the line without its numbers
};

}  // namespace kilvo::dds
