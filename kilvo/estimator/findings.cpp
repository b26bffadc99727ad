#include "kilvo/estimator/findings.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kilvo/estimator/initialise.hpp"
#include "kilvo/filter/stationarity.hpp"
#include "kilvo/math/decimals.hpp"
#include "kilvo/sensors/robot.hpp"

namespace kilvo {
namespace {

// The streams are looked at so often, and over so long what was used of them.
constexpr Duration streams_period = std::chrono::seconds(1), use_period = std::chrono::seconds(10);
// With fewer messages a sensor is not judged.
constexpr std::uint64_t few = 20;
// What differs from the biases at the start by more than this is no bias: of a sensor that drifts, and of none at all, m/s^2. Of the
// gyroscope they are largest_resting_rate and largest_gyro_bias.
constexpr double strange_accel = 0.3, impossible_accel = 0.8;
// Three times the speed at which no leg of this length can walk (Froude number 1): no robot runs faster either.
constexpr double fastest = 3.0;
// So many times within use_period no foot was at rest, and the velocity was reset.
constexpr std::uint64_t most_lost_stances = 3;

// What every start has, and what the user asked for.
bool is_usual(Reason r) {
  return r == Reason::not_used || r == Reason::before_start || r == Reason::before_motion || r == Reason::before_sweep;
}

const char* words_for(Sensor s) {
  constexpr const char* words[] = {"the IMU", "the legs", "the LiDAR", "the camera"};
  return words[static_cast<int>(s)];
}

}  // namespace

std::vector<std::string> warnings_of(const Statistics& statistics) {
  std::vector<std::string> out;
  for (const Event& event : statistics.events) {
    if (row_of(event.reason).severity != Severity::notice) out.push_back(text_of(event));
  }
  return out;
}

void Findings::report(const Situation& now, std::optional<Sensor> sensor, Reason reason, double value, std::string detail) {
  events_.raise({now.t, sensor, reason, value, 1, std::move(detail)});
  statistics_.events = events_.all();
}

void Findings::drop(Sensor sensor, Reason reason, const std::string& text) {
  ++of(sensor).dropped[text.empty() ? text_of(reason) : text];
  ++drops_[index_of(sensor)][static_cast<std::size_t>(reason)];
  if (reason == Reason::wrong_joints) joint_fault_ = text;
}

void Findings::look(Time t, const Situation& now) {
  if (t - streams_looked_at_ < streams_period) return;
  streams_looked_at_ = t;
  report_streams(now);
  judge_speed(now);
  judge_biases(now);
  judge_coasting(now);
  if (t - use_looked_at_ < use_period) return;
  use_looked_at_ = t;
  judge_stances(now);
  report_use(used_before_, now);
  for (std::size_t s = 0; s < sensor_count; ++s) used_before_.used[s] = statistics_.sensors[s].used;
  used_before_.dropped = drops_;
  used_before_.unsupported = statistics_.unsupported;
}

Findings Findings::next_epoch() {
  Findings next;
  next.statistics_ = std::move(statistics_);
  next.statistics_.diverged = false;
  next.statistics_.clock_shift = {};
  next.events_ = std::move(events_);
  next.drops_ = drops_;
  next.camera_carried_ = camera_carried_;
  // What was before is not judged again.
  for (std::size_t s = 0; s < sensor_count; ++s) next.used_before_.used[s] = next.statistics_.sensors[s].used;
  next.used_before_.dropped = next.drops_;
  next.used_before_.unsupported = next.statistics_.unsupported;
  next.lost_stances_before_ = next.statistics_.lost_stances;
  next.unmeasured_.stretches = unmeasured_.stretches;
  next.coasting_.stretches = coasting_.stretches;
  ++next.statistics_.epochs;
  return next;
}

void Findings::finish(const Situation& now) {
  report_streams(now);
  report_use({}, now);
}

void Findings::report_clipping(const Situation& now, const ImuSample& s, std::uint64_t count) {
  const double value = s.gyro_clipped ? s.gyro.cwiseAbs().maxCoeff() : s.accel.cwiseAbs().maxCoeff();
  events_.state({now.t, Sensor::imu, s.gyro_clipped ? Reason::gyro_clipped : Reason::accel_clipped, value, count, {}});
}

void Findings::report_gap(const Situation& now, double gap) {
  constexpr double worth_it = 0.1, all_around = 180;  // m, degrees
  const Covariance& P = now.estimate.P;
  const Eigen::Vector3d up_I = now.estimate.x.R.inverse() * -now.estimate.x.g.normalized();
  const double position = std::sqrt(P.block<3, 3>(at::p, at::p).trace()),
               heading = 57.295779513 * std::sqrt(up_I.dot(P.block<3, 3>(at::R, at::R) * up_I));
  if (position < worth_it) return;
  report(now, Sensor::imu, Reason::gap_of_imu, gap,
         decimals(position, 1) + " m and " + decimals(std::min(heading, all_around), 0) + " degrees");
}

void Findings::report_clock_steps(const Situation& now, const ClockSteps& steps) {
  statistics_.clock_steps = steps.count();
  const double back = to_seconds(steps.last());
  report(now, Sensor::imu, Reason::imu_clock_stepped, std::abs(back), back > 0 ? "back" : "ahead");
}

void Findings::report_clock_offset(const Situation& now, Sensor s, double total, double configured) {
  statistics_.clock_shift[index_of(s)] = total;
  report(now, s, Reason::clock_offset, total, std::string(name_of(s)) + ".time_offset to " + decimals(configured + total, 4));
}

// What the streams themselves showed.
void Findings::report_streams(const Situation& now) {
  statistics_.health = now.health.streams();
  for (const Sensor sensor : all_sensors) {
    const StreamHealth& stream = statistics_.health[index_of(sensor)];
    constexpr double late = 0.25;  // s
    if (stream.off_clock > 4) events_.state({now.t, sensor, Reason::clock_ahead, stream.clock_offset, stream.off_clock, {}});
    if (stream.messages > few && stream.mean_lag > late) events_.state({now.t, sensor, Reason::lagging, stream.mean_lag, 1, {}});
    if (stream.frozen > 0) events_.state({now.t, sensor, Reason::froze, 0, stream.frozen, {}});
  }
  constexpr double far_more = 10;
  if (now.accel_noise > far_more * now.configured_noise) events_.state({now.t, Sensor::imu, Reason::noisy_accel, now.accel_noise, 1, {}});
  if (events_.all() != statistics_.events) statistics_.events = events_.all();
}

// A sensor that was there and of little use since `before` is what the user must know of first.
void Findings::report_use(const Use& before, const Situation& now) {
  const std::uint64_t legs = statistics_.sensors[index_of(Sensor::legs)].used;
  const std::uint64_t unsupported = statistics_.unsupported - before.unsupported;
  // Even a running robot has a foot on the ground for more than half of the time.
  if (unsupported > few && 2 * unsupported > legs - before.used[index_of(Sensor::legs)]) {
    const double share = static_cast<double>(statistics_.unsupported) / static_cast<double>(legs);
    events_.state({now.t, Sensor::legs, Reason::feet_not_still, share, 1, {}});
  }
  for (std::size_t s = 0; s < sensor_count; ++s) {
    const std::uint64_t used = statistics_.sensors[s].used;
    for (std::size_t r = 0; r < reason_count; ++r) {
      const auto reason = static_cast<Reason>(r);
      const std::uint64_t dropped = drops_[s][r] - before.dropped[s][r];
      if (is_usual(reason) || dropped < few || 10 * dropped < used - before.used[s]) continue;
      const double ahead = reason == Reason::clock_ahead ? statistics_.health[s].clock_offset : 0;
      const std::string& detail = reason == Reason::wrong_joints ? joint_fault_ : std::string();
      events_.state({now.t, static_cast<Sensor>(s), reason, ahead, drops_[s][r], detail});
    }
  }
  const std::uint64_t images = statistics_.sensors[index_of(Sensor::camera)].used;
  if (!camera_carried_ && images > few) events_.state({now.t, Sensor::camera, Reason::nothing_seen, static_cast<double>(images), 1, {}});
  const auto lidar = index_of(Sensor::lidar), nowhere = static_cast<std::size_t>(Reason::fits_nowhere);
  const std::uint64_t refused = drops_[lidar][nowhere] - before.dropped[lidar][nowhere];
  if (!statistics_.diverged && refused > few && refused > statistics_.sensors[lidar].used - before.used[lidar]) {
    contradict(Reason::diverged, Sensor::lidar, witness_against(Sensor::lidar, now), static_cast<double>(refused),
               "most sweeps did not fit the map at the predicted pose", now);
  }
  if (events_.all() != statistics_.events) statistics_.events = events_.all();
}

void Findings::report_turned_camera(const Situation& now, const Eigen::Vector3d& turned, const std::optional<SO3>& corrected) {
  const auto tenths = [](double value) { return decimals(value, 1); };
  const Eigen::Vector3d degrees = turned * (180 / M_PI);
  if (corrected) {
    std::string R;
    for (const double element : corrected->matrix().reshaped<Eigen::RowMajor>()) R += (R.empty() ? "[" : ", ") + decimals(element, 5);
    return report(now, Sensor::camera, Reason::mount_corrected, degrees.norm(), R + "]");
  }
  report(now, Sensor::camera, Reason::camera_turned, degrees.norm(),
         tenths(degrees.x()) + ", " + tenths(degrees.y()) + ", " + tenths(degrees.z()));
}

bool Findings::Unmeasured::goes_on(Time now, Duration least) {
  if (!since) since = now;
  if (now - *since < least) return false;
  stretches += std::exchange(reported, true) ? 0 : 1;
  longest = std::max(longest, to_seconds(now - *since));
  return true;
}

// A robot that stands is held by that.
void Findings::judge_coasting(const Situation& now) {
  constexpr double stands = 0.05;  // m/s
  if (now.modality != Modality::coast || now.estimate.x.v.norm() < stands) return coasting_.end();
  if (coasting_.goes_on(now.t, streams_period)) events_.state({now.t, {}, Reason::coasting, coasting_.longest, coasting_.stretches, {}});
}

void Findings::note_unmeasured(const Situation& now, const std::optional<Eigen::Vector3d>& along) {
  if (!along) return unmeasured_.end();
  if (!unmeasured_.goes_on(now.t, 3 * streams_period)) return;
  const auto axis = [&along](int i) { return decimals(std::abs((*along)[i]) < 0.05 ? 0.0 : (*along)[i], 1); };  // no "-0.0"
  events_.state({now.t, Sensor::lidar, Reason::unmeasured, unmeasured_.longest, unmeasured_.stretches,
                 "(" + axis(0) + ", " + axis(1) + ", " + axis(2) + ")"});
}

void Findings::report_new_map(const Situation& now) {
  ++statistics_.maps_begun_anew;
  report(now, Sensor::lidar, Reason::map_begun_anew);
  contradict(Reason::diverged, Sensor::lidar, witness_against(Sensor::lidar, now), 2,
             "for 2 s no sweep fitted the map at the predicted pose", now);
}

Sensor Findings::witness_against(Sensor s, const Situation& now) {
  if (s != Sensor::legs && now.legs_used && now.estimate.t - now.last_used_stance < std::chrono::seconds(5)) return Sensor::legs;
  if (s == Sensor::imu && has_lidar(now.modality)) return Sensor::lidar;
  if (s == Sensor::imu && now.legs_used) return Sensor::legs;
  return Sensor::imu;
}

void Findings::contradict(Reason reason, Sensor a, Sensor b, double value, const std::string& why, const Situation& now) {
  if (reason == Reason::diverged) statistics_.diverged = true;
  report(now, {}, reason, value, std::string(words_for(a)) + " and " + words_for(b) + " contradict each other: " + why);
}

void Findings::judge_stances(const Situation& now) {
  const std::uint64_t lost = statistics_.lost_stances - lost_stances_before_;
  lost_stances_before_ = statistics_.lost_stances;
  if (lost >= most_lost_stances && !statistics_.diverged)
    contradict(Reason::diverged, Sensor::legs, has_lidar(now.modality) ? Sensor::lidar : Sensor::imu, static_cast<double>(lost),
               "for seconds no foot was at rest, and the velocity was reset " + std::to_string(lost) + " times in 10 s", now);
}

void Findings::judge_speed(const Situation& now) {
  const double speed = now.estimate.x.v.norm(), limit = fastest * std::sqrt(standard_gravity * now.leg_length);
  const double sigma = std::sqrt(std::max(0.0, now.estimate.P.diagonal().segment<3>(at::v).maxCoeff()));
  if (speed < limit || sigma > 0.3 * speed || statistics_.diverged) return;
  contradict(Reason::diverged, Sensor::imu, has_lidar(now.modality) ? Sensor::lidar : Sensor::legs, speed,
             "together they give a speed of " + decimals(speed, 1) + " m/s", now);
}

void Findings::judge_biases(const Situation& now) {
  const auto sigma = [&now](int part) { return std::sqrt(std::max(0.0, now.estimate.P.diagonal().segment<3>(part).maxCoeff())); };
  const double accel_sigma = sigma(at::ba), gyro_sigma = sigma(at::bg);
  const Biases present = {now.estimate.x.ba, now.estimate.x.bg};
  if (!first_biases_) first_biases_ = present;
  // Those of a start on the move are a guess: they may be anything until they are known.
  if (!known_biases_ && 5 * accel_sigma < strange_accel && 5 * gyro_sigma < largest_resting_rate) known_biases_ = present;
  if (!known_biases_) return;
  // Aliased noise walks a bias: it may have gone as far as it is uncertain.
  const auto beyond = [&](const Biases& before, double accel, double gyro) {
    return (present.accel - before.accel).norm() > accel + 3 * accel_sigma || (present.gyro - before.gyro).norm() > gyro + 3 * gyro_sigma;
  };
  // The shocks of the first steps, cut by the accelerometer's range, turn bias and gravity for a second or two.
  const bool impossible = beyond(*first_biases_, impossible_accel, largest_gyro_bias);
  impossible_since_ = impossible ? std::optional(impossible_since_.value_or(now.t)) : std::nullopt;
  if (impossible && now.t - *impossible_since_ < 2 * streams_period) return;
  if (impossible ? statistics_.diverged : strange_biases_ || !beyond(*known_biases_, strange_accel, largest_resting_rate)) return;
  strange_biases_ = true;
  const Biases& before = impossible ? *first_biases_ : *known_biases_;
  const double accel = (present.accel - before.accel).norm();
  const std::string why = "the biases that would reconcile them have changed by " + decimals(accel, 2) + " m/s^2 and " +
                          decimals((present.gyro - before.gyro).norm(), 3) + " rad/s: check the mount";
  contradict(impossible ? Reason::diverged : Reason::inconsistent, Sensor::imu, has_lidar(now.modality) ? Sensor::lidar : Sensor::legs,
             accel, why, now);
}

}  // namespace kilvo
