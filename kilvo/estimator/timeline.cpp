#include "kilvo/estimator/timeline.hpp"

#include <algorithm>

namespace kilvo {

Time completion_of(const Measurement& m) {
  const auto* scan = std::get_if<LidarScan>(&m);
  if (scan == nullptr || scan->points.empty()) return stamp_of(m);
  std::int32_t last = scan->points.front().offset_ns;
  for (const LidarPoint& p : scan->points) last = std::max(last, p.offset_ns);
  return scan->t + Duration(last);
}

Time begin_of(const LidarScan& scan) {
  std::int32_t first = scan.points.empty() ? 0 : scan.points.front().offset_ns;
  for (const LidarPoint& p : scan.points) first = std::min(first, p.offset_ns);
  return scan.t + Duration(first);
}

void Timeline::give_up_suspects() {
  for (const Measurement& m : suspects_) jumped_.push_back(sensor_of(m));
  suspects_.clear();
}

void Timeline::end() {
  give_up_suspects();
  ended_ = true;
}

std::optional<std::string> Timeline::push(Measurement m) {
  constexpr Duration jump = std::chrono::seconds(1);
  constexpr std::size_t witnesses = 10;
  const Time key = completion_of(m);
  if (!newest_of_all_ || key - *newest_of_all_ <= jump) {
    give_up_suspects();
    return admit(std::move(m), key);
  }
  suspects_.push_back(std::move(m));
  if (suspects_.size() < witnesses) return std::nullopt;
  for (Measurement& suspect : std::exchange(suspects_, {})) {
    const Time suspect_key = completion_of(suspect);
    const Sensor sensor = sensor_of(suspect);
    if (admit(std::move(suspect), suspect_key)) jumped_.push_back(sensor);
  }
  return std::nullopt;
}

std::optional<std::string> Timeline::admit(Measurement m, Time key) {
  const Time stamp = stamp_of(m);
  const auto s = static_cast<std::size_t>(sensor_of(m));
  if (stamp_[s] == stamp) return "duplicate";
  if (released_ && key < *released_) return "late";
  if (!newest_[s] || key > *newest_[s]) {
    newest_[s] = key;
    stamp_[s] = stamp;
  }
  newest_of_all_ = std::max(newest_of_all_.value_or(key), key);
  const auto place = std::tuple(key, sensor_of(m), sequence_++);
  if (spare_.empty()) {
    waiting_.emplace(place, std::move(m));
  } else {
    spare_.back().key() = place;
    spare_.back().mapped() = std::move(m);
    waiting_.insert(std::move(spare_.back()));
    spare_.pop_back();
  }
  return std::nullopt;
}

bool Timeline::may_go(Time key) const {
  // The IMU, which everything needs, is the clock: one sensor that is ahead of it must not make all others late. If it is silent, so much
  // may gather and no more.
  constexpr std::size_t most = 5000;
  const auto& imu = newest_[static_cast<std::size_t>(Sensor::imu)];
  const bool waited =
      expected_[static_cast<std::size_t>(Sensor::imu)] ? imu && *imu - key >= max_wait_ : *newest_of_all_ - key >= max_wait_;
  if (ended_ || waited || waiting_.size() > most) return true;
  for (std::size_t s = 0; s < sensor_count; ++s) {
    if (expected_[s] && (!newest_[s] || *newest_[s] < key)) return false;
  }
  return true;
}

std::optional<Measurement> Timeline::pop() {
  if (waiting_.empty() || !may_go(std::get<Time>(waiting_.begin()->first))) return std::nullopt;
  auto first = waiting_.extract(waiting_.begin());
  released_ = std::get<Time>(first.key());
  std::optional<Measurement> out = std::move(first.mapped());
  constexpr std::size_t most_spare = 64;
  if (spare_.size() < most_spare) spare_.push_back(std::move(first));
  return out;
}

}  // namespace kilvo
