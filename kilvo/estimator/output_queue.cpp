#include "kilvo/estimator/output_queue.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace kilvo {

Output* OutputQueue::next(Time t, std::vector<Output>& out) {
  if (last_ && t <= *last_) return nullptr;
  last_ = t;
  Output* const o = &out.emplace_back();
  if (!sweeps_.empty()) {
    *o = std::move(sweeps_.front());
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

}  // namespace kilvo
