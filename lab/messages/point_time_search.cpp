#include "lab/messages/point_time_search.hpp"

#include "lab/messages/message_decoder.hpp"

namespace kilvo::lab {

void PointTimeSearch::look_at(const WireMessage& message) {
  auto times = observe_cloud(type_, message);
  if (!times || has_enough()) return;
  const bool is_full = times->points > points_of_a_full_cloud;
  if (is_full || (times->points > 1 && small_.size() < clouds_to_look_at)) (is_full ? full_ : small_).push_back(*std::move(times));
}

Decoded<PointTimeFormat> PointTimeSearch::decide() const {
  const Duration period = from_seconds(nominal_rate_ > 0 ? 1 / nominal_rate_ : 0.1);
  return detect_point_time_of(type_, full_.empty() ? small_ : full_, period);
}

}  // namespace kilvo::lab
