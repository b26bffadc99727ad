#include "kilvo/input/timeline.hpp"

#include <algorithm>

#include "kilvo/sensors/time.hpp"

namespace kilvo {

void Timeline::give_up_suspects() {
  for (const Measurement& m : suspects_) refused_.push_back({sensor_of(m), Reason::time_jump});
  suspects_.clear();
}

void Timeline::end() {
  give_up_suspects();
  ended_ = true;
}

void Timeline::push(Measurement m) {
  const Time key = completion_of(m);
  if (!newest_of_all_ || key - *newest_of_all_ <= clock_jump) {
    give_up_suspects();
    const Sensor sensor = sensor_of(m);
    if (const auto reason = admit(std::move(m), key)) refused_.push_back({sensor, *reason});
    return;
  }
  suspects_.push_back(std::move(m));
  if (suspects_.size() < clock_witnesses) return;
  for (Measurement& suspect : std::exchange(suspects_, {})) {
    const Time suspect_key = completion_of(suspect);
    const Sensor sensor = sensor_of(suspect);
    if (admit(std::move(suspect), suspect_key)) refused_.push_back({sensor, Reason::time_jump});
  }
}

std::optional<Reason> Timeline::admit(Measurement m, Time key) {
  const Sensor sensor = sensor_of(m);
  ClockModel& clock = clocks_[index_of(sensor)];
  const auto& imu = newest(Sensor::imu);
  if (clock.newest == key) return Reason::duplicate;
  if (sensor == Sensor::imu && !first_imu_) first_imu_ = key;
  // Who speaks again is waited for again, and for as long as it takes, even if this message is too late.
  if (imu) clock.note_lag(*imu - key, max_wait_);
  // What is fused at its own time may come after others.
  const bool is_frame = sensor == Sensor::lidar || sensor == Sensor::camera;
  const bool late = released_ && key < *released_ - (is_frame ? max_wait_ : Duration(0));
  if ((!late || sensor == Sensor::legs) && (!clock.newest || key > *clock.newest)) clock.note(key);
  if (late) return Reason::late;
  newest_of_all_ = std::max(newest_of_all_.value_or(key), key);
  waiting_.push(key, std::move(m));
  // The IMU is the clock: nothing of it waits for long.
  if (sensor != Sensor::imu) refused_.insert(refused_.end(), waiting_.bound(sensor, *clock.newest), {sensor, Reason::no_imu});
  return std::nullopt;
}

// Something may come of this sensor that must go before.
bool Timeline::is_awaited(Sensor sensor, Time key) const {
  if (sensor == Sensor::camera && !wait_for_images_) return false;
  const bool is_frame = sensor == Sensor::lidar || sensor == Sensor::camera;
  const ClockModel& clock = clocks_[index_of(sensor)];
  if (const auto& imu = newest(Sensor::imu); imu && sensor != Sensor::imu) {
    // Who has been silent for long, or was never there, is not waited for.
    const Duration lag = std::max(Duration(0), clock.lag.value_or(Duration(0)));
    const Duration longest = is_frame ? std::max(max_wait_, 3 * clock.spacing) : std::max(least_silence, 5 * clock.spacing) + lag;
    if (clock.newest ? *imu - *clock.newest > longest : !is_frame && *imu - *first_imu_ > clock_jump) return false;
  }
  // A frame that comes so much sooner than the one before is fused late, no more.
  return !clock.newest || *clock.newest + (is_frame ? 7 * clock.spacing / 10 : Duration(0)) < key;
}

bool Timeline::may_go(Time key) const {
  // The IMU is the clock: one sensor that is ahead of it must not make all others late. If it is silent, so much may gather.
  constexpr std::size_t most = 5000;
  const auto& imu = newest(Sensor::imu);
  const bool waited = expected_[index_of(Sensor::imu)] ? imu && *imu - key >= max_wait_ : *newest_of_all_ - key >= max_wait_;
  if (ended_ || waited || waiting_.size() > most) return true;
  return std::ranges::none_of(all_sensors, [&](Sensor s) { return expected_[index_of(s)] && is_awaited(s, key); });
}

std::optional<Measurement> Timeline::pop() {
  if (waiting_.empty() || !may_go(waiting_.first())) return std::nullopt;
  released_ = std::max(released_.value_or(waiting_.first()), waiting_.first());
  return waiting_.pop();
}

}  // namespace kilvo
