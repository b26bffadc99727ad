#include "kilvo/estimator/sensor_status.hpp"

#include <algorithm>

#include "kilvo/estimator/silence.hpp"

namespace kilvo {
namespace {

constexpr Duration least_silence = std::chrono::milliseconds(300);  // of sweeps and images

}  // namespace

void SensorStatus::begin(Time t, bool legs) {
  last_sweep_ = t;
  if (legs) last_legs_ = t;
}

void SensorStatus::sweep_used(Time end) {
  last_sweep_ = end;
  sweeps_were_there_ = true;
  frames_wait_[index_of(Sensor::lidar)].reset();
}

void SensorStatus::image_used(Time t) {
  last_image_ = t;
  frames_wait_[index_of(Sensor::camera)].reset();
}

bool SensorStatus::is_missing(Sensor s) const {
  return s == Sensor::lidar ? sweeps_were_there_ && !has_lidar(modality_) : last_image_.has_value() && !has_camera(modality_);
}

bool SensorStatus::has_waited_less(Sensor s, Time t, Duration longest) {
  std::optional<Time>& since = frames_wait_[index_of(s)];
  if (!since) since = t;
  return t - *since < longest;
}

void SensorStatus::legs_used(Time t) {
  constexpr double longest = 0.1;  // s
  if (last_legs_) leg_period_ = std::min(longest, to_seconds(t - *last_legs_));
  last_legs_ = t;
}

void SensorStatus::lose_legs(bool were_there) {
  legs_were_there_ = were_there;
  legs_wait_.reset();
  last_legs_.reset();
}

void SensorStatus::miss_legs() {
  lose_legs(true);
  if (!kilvo::has_legs(modality_)) return;
  modality_ = without_legs(modality_);
  cause_ = Reason::legs_lost;
}

bool SensorStatus::may_legs_return(Time t, bool is_calm, bool is_velocity_known, const Health& health) {
  if (has_legs() || !legs_were_there_) return true;
  constexpr Duration longest_wait = std::chrono::seconds(1);
  if (!legs_wait_) legs_wait_ = t;
  if (health.is_frozen(Sensor::legs)) return false;
  // Sweeps, if there are any, tell the velocity soon.
  const auto heard = health.heard(Sensor::lidar);
  const bool sweeps = heard && t - *heard < silence(rate_of(Sensor::lidar), 4, least_silence);
  const bool ready = is_calm && (is_velocity_known || !sweeps);
  if (!ready && t - *legs_wait_ < longest_wait) return false;
  legs_wait_.reset();
  return true;
}

bool SensorStatus::are_legs_lost(Time imu_heard, const Health& health) const {
  return last_legs_ && (health.is_frozen(Sensor::legs) || imu_heard - *last_legs_ > silence_of_legs(rate_of(Sensor::legs)));
}

bool SensorStatus::are_legs_overdue(Time t) const { return kilvo::are_legs_overdue(t - *last_legs_, rate_of(Sensor::legs), leg_period_); }

void SensorStatus::lose_imu(const Health& health) {
  imu_lost_ = true;
  modality_ = Modality::coast;
  cause_ = health.is_frozen(Sensor::imu) ? Reason::imu_frozen : Reason::imu_lost;
}

SensorStatus::Change SensorStatus::choose(Time t, const Health& health) {
  const bool lidar = with_lidar_ && t - last_sweep_ <= silence(rate_of(Sensor::lidar), 3, least_silence);
  const bool camera = last_image_ && t - *last_image_ <= silence(rate_of(Sensor::camera), 3, least_silence);
  const Modality now = modality_of(has_legs(), lidar, camera);
  const bool after_outage = cause_ == Reason::imu_lost || cause_ == Reason::imu_frozen;
  if (after_outage) cause_ = Reason::imu_back;
  if (now == modality_) return after_outage ? Change::of_cause : Change::none;
  const bool first = modality_ == Modality::coast && cause_ == Reason::start;
  if (!after_outage && !first) cause_ = cause_of_change(t, now, health);
  modality_ = now;
  return Change::of_modality;
}

Reason SensorStatus::cause_of_change(Time t, Modality now, const Health& health) const {
  if (has_lidar(now) != has_lidar(modality_))
    return has_lidar(now) ? Reason::lidar_back : health.is_frozen(Sensor::lidar) ? Reason::lidar_frozen : Reason::lidar_lost;
  if (kilvo::has_legs(now) != kilvo::has_legs(modality_))
    return kilvo::has_legs(now) ? Reason::legs_back : health.is_frozen(Sensor::legs) ? Reason::legs_frozen : Reason::legs_lost;
  if (has_camera(now)) return Reason::camera_used;
  const auto heard = health.heard(Sensor::camera);
  const bool silent = !heard || t - *heard > silence(rate_of(Sensor::camera), 3, least_silence);
  return health.is_frozen(Sensor::camera) ? Reason::camera_frozen : silent ? Reason::camera_lost : Reason::camera_useless;
}

}  // namespace kilvo
