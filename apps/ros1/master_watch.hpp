// roscpp tells a master of its topics once. When a master has died and another one stands in its place, this tells it again.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

namespace kilvo::ros1 {

class MasterWatch {
 public:
  /// `services`: those that the node offers.
  explicit MasterWatch(std::vector<std::string> services) : services_(std::move(services)) {}

  /// Looks at most once a second. From one thread.
  void look();

 private:
  void introduce() const;

  std::vector<std::string> services_;
  std::chrono::steady_clock::time_point looked_{};
  std::optional<int> master_;  // its process; of the one that knows us
  bool gone_ = false;
};

}  // namespace kilvo::ros1
