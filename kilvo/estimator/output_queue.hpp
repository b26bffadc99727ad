// Results of sweeps and images, each of which goes out with one of the next states; one output for each time.
#pragma once

#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "kilvo/estimator/output.hpp"

namespace kilvo {

class OutputQueue {
 public:
  /// A sweep's, an image's part of an output that has yet to come.
  void add_sweep(Output o) { sweeps_.push_back(std::move(o)); }
  void add_image(Output o) { images_.push_back(std::move(o)); }
  bool empty() const { return sweeps_.empty() && images_.empty(); }
  bool has_sweep() const { return !sweeps_.empty(); }

  /// Appends the output of `t`, with the oldest results that wait; none when one of this time has been emitted.
  Output* next(Time t, std::vector<Output>& out);
  std::optional<Time> last() const { return last_; }

 private:
  std::deque<Output> sweeps_, images_;
  std::optional<Time> last_;  // of what went out
};

}  // namespace kilvo
