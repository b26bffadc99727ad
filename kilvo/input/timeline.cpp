#include "kilvo/input/timeline.hpp"

#include <algorithm>

namespace kilvo {

Time completion_of(const Measurement& m) {
  const auto* scan = std::get_if<LidarScan>(&m);
  return scan == nullptr ? stamp_of(m) : end_of(*scan);
}

Time end_of(const LidarScan& scan) {
  std::int32_t last = scan.points.empty() ? 0 : scan.points.front().offset_ns;
  for (const LidarPoint& p : scan.points) last = std::max(last, p.offset_ns);
  return scan.t + Duration(last);
}

Time begin_of(const LidarScan& scan) {
  std::int32_t first = scan.points.empty() ? 0 : scan.points.front().offset_ns;
  for (const LidarPoint& p : scan.points) first = std::min(first, p.offset_ns);
  return scan.t + Duration(first);
}

namespace {

// Of one sensor no more waits than this: bytes, and time between the oldest and the newest.
constexpr std::size_t most_bytes = std::size_t{64} << 20;
constexpr Duration longest_wait = std::chrono::seconds(3);
// A sensor that comes often is missed when it has been silent for so long, and never waited for when it has not come for so long at all.
constexpr Duration silence = std::chrono::milliseconds(50), never = std::chrono::seconds(1);

std::size_t bytes_of(const Measurement& m) {
  if (const auto* scan = std::get_if<LidarScan>(&m)) return scan->points.size() * sizeof(LidarPoint);
  if (const auto* image = std::get_if<CameraImage>(&m)) return image->image.pixels.size();
  return sizeof(Measurement);
}

}  // namespace

void Timeline::give_up_suspects() {
  for (const Measurement& m : suspects_) jumped_.push_back(sensor_of(m));
  suspects_.clear();
}

void Timeline::end() {
  give_up_suspects();
  ended_ = true;
}

std::optional<Reason> Timeline::push(Measurement m) {
  const Time key = completion_of(m);
  if (!newest_of_all_ || key - *newest_of_all_ <= clock_jump) {
    give_up_suspects();
    return admit(std::move(m), key);
  }
  suspects_.push_back(std::move(m));
  if (suspects_.size() < clock_witnesses) return std::nullopt;
  for (Measurement& suspect : std::exchange(suspects_, {})) {
    const Time suspect_key = completion_of(suspect);
    const Sensor sensor = sensor_of(suspect);
    if (admit(std::move(suspect), suspect_key)) jumped_.push_back(sensor);
  }
  return std::nullopt;
}

std::optional<Reason> Timeline::admit(Measurement m, Time key) {
  const Time stamp = stamp_of(m);
  const Sensor sensor = sensor_of(m);
  const std::size_t s = index_of(sensor);
  if (stamp_[s] == stamp) return Reason::duplicate;
  if (sensor == Sensor::imu && !first_imu_) first_imu_ = key;
  if (sensor == Sensor::legs) note_legs(key);
  // What is fused at its own time may come after others.
  const Duration patience = sensor == Sensor::lidar || sensor == Sensor::camera ? max_wait_ : Duration(0);
  if (released_ && key < *released_ - patience) return Reason::late;
  if (!newest_[s] || key > *newest_[s]) {
    note_spacing(s, key);
    newest_[s] = key;
    stamp_[s] = stamp;
  }
  newest_of_all_ = std::max(newest_of_all_.value_or(key), key);
  bytes_[s] += bytes_of(m);
  const auto place = std::tuple(key, sensor, sequence_++);
  if (spare_.empty()) {
    waiting_.emplace(place, std::move(m));
  } else {
    spare_.back().key() = place;
    spare_.back().mapped() = std::move(m);
    waiting_.insert(std::move(spare_.back()));
    spare_.pop_back();
  }
  bound(sensor);
  return std::nullopt;
}

// Whoever speaks again is waited for again, and for as long as it takes, even if this message is too late.
void Timeline::note_legs(Time key) {
  const auto& imu = newest_[index_of(Sensor::imu)];
  legs_lag_ -= legs_lag_ / 4096;
  if (imu) legs_lag_ = std::clamp(*imu - key, legs_lag_, max_wait_);
  auto& newest = newest_[index_of(Sensor::legs)];
  if (released_ && key < *released_) newest = std::max(newest.value_or(key), key);
}

void Timeline::bound(Sensor sensor) {
  // It is the clock: nothing of it waits for long.
  if (sensor == Sensor::imu) return;
  const std::size_t s = index_of(sensor);
  for (auto oldest = waiting_.begin(); oldest != waiting_.end();) {
    // Nothing that waits is older than what waits at the front.
    if (bytes_[s] <= most_bytes && *newest_[s] - std::get<Time>(oldest->first) <= longest_wait) return;
    if (std::get<Sensor>(oldest->first) != sensor) {
      ++oldest;
      continue;
    }
    const std::size_t size = bytes_of(oldest->second);
    if (bytes_[s] == size) return;  // it is the only one
    bytes_[s] -= size;
    given_up_.push_back(sensor);
    oldest = waiting_.erase(oldest);
  }
}

void Timeline::note_spacing(std::size_t s, Time key) {
  if (!newest_[s]) return;
  const Duration gap = key - *newest_[s];
  // Grows slowly, whatever was missed: a message more that is waited for costs little, one that is not may come too late.
  spacing_[s] = spacing_[s] == Duration(0) || gap < spacing_[s] ? gap : spacing_[s] + (std::min(gap, 2 * spacing_[s]) - spacing_[s]) / 8;
}

// Something may come of this sensor that must go before.
bool Timeline::is_awaited(Sensor sensor, Time key) const {
  const std::size_t s = index_of(sensor);
  if (sensor == Sensor::camera && !wait_for_images_) return false;
  const bool is_frame = sensor == Sensor::lidar || sensor == Sensor::camera;
  const auto& imu = newest_[index_of(Sensor::imu)];
  // Who has been silent for long, or was never there, is not waited for.
  const Duration longest = is_frame ? std::max(max_wait_, 3 * spacing_[s]) : std::max(silence, 5 * spacing_[s]) + legs_lag_;
  if (sensor != Sensor::imu && imu && newest_[s] && *imu - *newest_[s] > longest) return false;
  if (!is_frame && imu && first_imu_ && !newest_[s] && *imu - *first_imu_ > never) return false;
  // A frame that comes so much sooner than the one before is fused late, no more.
  return !newest_[s] || *newest_[s] + (is_frame ? 7 * spacing_[s] / 10 : Duration(0)) < key;
}

bool Timeline::may_go(Time key) const {
  // The IMU, which everything needs, is the clock: one sensor that is ahead of it must not make all others late. If it is silent, so much
  // may gather and no more.
  constexpr std::size_t most = 5000;
  const auto& imu = newest_[index_of(Sensor::imu)];
  const bool waited = expected_[index_of(Sensor::imu)] ? imu && *imu - key >= max_wait_ : *newest_of_all_ - key >= max_wait_;
  if (ended_ || waited || waiting_.size() > most) return true;
  return std::ranges::none_of(all_sensors, [&](Sensor s) { return expected_[index_of(s)] && is_awaited(s, key); });
}

std::optional<Measurement> Timeline::pop() {
  if (waiting_.empty() || !may_go(std::get<Time>(waiting_.begin()->first))) return std::nullopt;
  auto first = waiting_.extract(waiting_.begin());
  const Time key = std::get<Time>(first.key());
  bytes_[static_cast<std::size_t>(std::get<Sensor>(first.key()))] -= bytes_of(first.mapped());
  released_ = std::max(released_.value_or(key), key);
  std::optional<Measurement> out = std::move(first.mapped());
  constexpr std::size_t most_spare = 64;
  if (spare_.size() < most_spare) spare_.push_back(std::move(first));
  return out;
}

}  // namespace kilvo
