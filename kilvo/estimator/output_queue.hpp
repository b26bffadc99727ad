// Results of sweeps and images, each of which goes out with one of the next states; one output for each time.
#pragma once

#include <algorithm>
#include <deque>
#include <iterator>
#include <optional>
#include <utility>

#include "kilvo/estimator/output.hpp"

namespace kilvo {

class OutputQueue {
 public:
  /// A sweep's, an image's part of an output that has yet to come.
  void add_sweep(Output o) { sweeps_.push_back(std::move(o)); }
  void add_image(Output o) { images_.push_back(std::move(o)); }
  bool empty() const { return sweeps_.empty() && images_.empty(); }
  bool has_sweep() const { return !sweeps_.empty(); }

  /// The output of `t`, with the oldest results that wait; none when one of this time has gone out, which has said it all.
  std::optional<Output> next(Time t) {
    if (last_ && t <= *last_) return std::nullopt;
    last_ = t;
    std::optional<Output> o(std::in_place);
    if (!sweeps_.empty()) {
      o = std::move(sweeps_.front());
      o->is_sweep = true;
      sweeps_.pop_front();
    }
    if (!images_.empty()) {
      Output& image = images_.front();
      o->is_image = true;
      o->stages.visual_us = image.stages.visual_us;
      o->coloured = std::move(image.coloured);
      std::ranges::copy(image.indicators, std::back_inserter(o->indicators));
      images_.pop_front();
    }
    o->t = t;
    return o;
  }
  std::optional<Time> last() const { return last_; }

 private:
  std::deque<Output> sweeps_, images_;
  std::optional<Time> last_;  // of what went out
};

}  // namespace kilvo
