#include "kilvo/estimator/sensor_status.hpp"

#include <algorithm>
#include <utility>

#include "kilvo/filter/gap.hpp"

namespace kilvo {

SensorStatus::SensorStatus(const Robot& robot, bool settles) : settles_(settles) {
  const auto rates = rates_of(robot);
  for (std::size_t s = 0; s < sensor_count; ++s) tracks_[s].rate = rates[s];
}

bool SensorStatus::are_legs_silent(Duration since) const {
  return since > std::max(least_silence, from_seconds(5 / rate_of(Sensor::legs)));
}

bool SensorStatus::is_imu_missing(Duration since) const { return to_seconds(since) > std::max(blind_gap, 5 / rate_of(Sensor::imu)); }

void SensorStatus::begin(Time t, const std::array<bool, sensor_count>& there) {
  for (const Sensor s : {Sensor::legs, Sensor::lidar}) {
    if (there[index_of(s)]) track(s).used = t;
  }
}

void SensorStatus::use(Sensor s, Time t) {
  Track& of = track(s);
  if (s == Sensor::legs && of.used) leg_period_ = std::min(blind_gap, to_seconds(t - *of.used));
  of.used = t;
  of.was_used = true;
  of.waits_since.reset();
}

// Since this was first asked about, for so long that it goes on without calm.
bool SensorStatus::has_waited(Sensor s, Time t) {
  constexpr Duration patience = std::chrono::seconds(1);
  std::optional<Time>& since = track(s).waits_since;
  if (!since) since = t;
  return t - *since >= patience;
}

void SensorStatus::lose_legs() {
  track(Sensor::legs).waits_since.reset();
  track(Sensor::legs).used.reset();
}

void SensorStatus::miss_legs() {
  lose_legs();
  if (!std::exchange(track(Sensor::legs).counts, false)) return;
  modality_ = modality_of(false, has_lidar(modality_), has_camera(modality_));
  cause_ = Reason::legs_lost;
}

bool SensorStatus::may_legs_return(Time t, bool is_calm, bool is_velocity_known, const Health& health) {
  if (has_legs() || !track(Sensor::legs).was_used) return true;
  const bool has_waited_long = has_waited(Sensor::legs, t);
  if (health.is_frozen(Sensor::legs)) return false;
  // Sweeps, if there are any, measure the velocity soon.
  const auto heard = health.heard(Sensor::lidar);
  const bool sweeps = heard && !is_silence(t - *heard, rate_of(Sensor::lidar));
  const bool ready = (is_calm || !settles_) && (is_velocity_known || !sweeps);
  if (!ready && !has_waited_long) return false;
  track(Sensor::legs).waits_since.reset();
  return true;
}

bool SensorStatus::are_legs_lost(Time imu_heard, const Health& health) const {
  const auto last = last_used(Sensor::legs);
  return last && (health.is_frozen(Sensor::legs) || are_legs_silent(imu_heard - *last));
}

bool SensorStatus::are_legs_overdue(Time t) const {
  const Duration due = std::max(from_seconds(periods_of_a_gap / rate_of(Sensor::legs)), from_seconds(periods_of_a_gap * leg_period_));
  return t - *last_used(Sensor::legs) >= due;
}

void SensorStatus::lose_imu(const Health& health) {
  imu_lost_ = true;
  for (Track& of : tracks_) of.counts = false;
  modality_ = Modality::coast;
  cause_ = health.is_frozen(Sensor::imu) ? Reason::imu_frozen : Reason::imu_lost;
}

SensorStatus::Change SensorStatus::choose(Time t, const Health& health) {
  std::optional<Sensor> changed;  // the first of these
  for (const Sensor s : {Sensor::lidar, Sensor::legs, Sensor::camera}) {
    const auto used = last_used(s);
    // Of the legs lose_legs() decides.
    const bool is_there = used && (s == Sensor::legs || !is_silence(t - *used, rate_of(s)));
    const bool counts = is_there && (s != Sensor::camera || track(Sensor::lidar).counts);
    if (counts != std::exchange(track(s).counts, counts) && !changed) changed = s;
  }
  const Modality now = modality_of(track(Sensor::legs).counts, track(Sensor::lidar).counts, track(Sensor::camera).counts);
  const bool after_outage = cause_ == Reason::imu_lost || cause_ == Reason::imu_frozen;
  const bool first = modality_ == Modality::coast && cause_ == Reason::start;
  if (after_outage) cause_ = Reason::imu_back;
  if (changed && !after_outage && !first) cause_ = cause_of_change(*changed, t, health);
  if (now == modality_) return after_outage ? Change::of_cause : Change::none;
  modality_ = now;
  return Change::of_modality;
}

Reason SensorStatus::cause_of_change(Sensor s, Time t, const Health& health) const {
  static_assert(static_cast<int>(Reason::imu_lost) == 1 && static_cast<std::size_t>(Reason::camera_useless) == 3 * sensor_count + 1);
  const bool is_back = tracks_[index_of(s)].counts, is_frozen = health.is_frozen(s);
  const auto heard = health.heard(s);
  const bool is_useless = s == Sensor::camera && heard && !is_silence(t - *heard, rate_of(s));
  if (!is_back && !is_frozen && is_useless) return Reason::camera_useless;
  return static_cast<Reason>(1 + 3 * static_cast<int>(s) + (is_back ? 2 : is_frozen ? 1 : 0));
}

}  // namespace kilvo
