#include "lab/clocks/leg_clock.hpp"

#include <array>

namespace kilvo::lab {
namespace {

// As long as no rate is larger, a wrong time moves no joint by what could be seen; it is above the largest bias of a gyroscope, rad/s.
constexpr double calm = 0.05;

}  // namespace

LegClock::LegClock(const LegClockConfig& config, const Robot& robot)
    : mode_(config.clock == "estimated" ? Mode::estimated
            : config.clock == "arrival" ? Mode::arrival
                                        : Mode::stamp),
      time_offset_(robot.legs.time_offset),
      with_gyro_(!config.gyro_link.empty()),
      legs_(1 / robot.legs.rate),
      imu_(1 / robot.imu.rate) {
  if (mode_ != Mode::estimated) return;
  if (with_gyro_) {
    links_.emplace_back(robot, config.gyro_link);
  } else {
    for (const Foot& foot : robot.feet) links_.emplace_back(robot, foot.link);
  }
}

const char* LegClock::follow(Measurement& m, Time arrived, const LowLevel& low_level) {
  if (mode_ == Mode::stamp) return nullptr;
  if (auto* imu = std::get_if<ImuSample>(&m)) follow(*imu, arrived, low_level);
  if (auto* joints = std::get_if<JointSample>(&m)) return follow(*joints, arrived, low_level);
  return nullptr;
}

void LegClock::follow(ImuSample& s, Time arrived, const LowLevel& low_level) {
  imu_is_beside_ = low_level.tick.has_value();
  if (imu_is_beside_) {
    s.t = legs_.follow(tick_.unwrapped(*low_level.tick), arrived);
    return;
  }
  if (mode_ != Mode::estimated || !s.gyro.allFinite()) return;
  imu_ahead_ = s.t - imu_.follow(s.t.time_since_epoch(), arrived);
  rates_.add_reference(s.t, s.gyro);
}

const char* LegClock::follow(JointSample& s, Time arrived, const LowLevel& low_level) {
  std::optional<Duration> device;
  if (low_level.tick) {
    device = tick_.unwrapped(*low_level.tick);
  } else if (s.t - from_seconds(time_offset_) != arrived) {
    device = s.t.time_since_epoch();
  }
  const Duration offset = from_seconds(time_offset_);
  s.t = legs_.follow(device, arrived) + offset;
  if (mode_ == Mode::arrival || imu_is_beside_) return nullptr;
  s.t += imu_ahead_;
  add_rates(s, low_level);
  const auto found = rates_.offset();
  if (found) {
    s.t += from_seconds(*found);
    return nullptr;
  }
  if (rates_.liveliness() < calm) return nullptr;
  ++withheld_;
  return "clock not known yet";
}

// A link that turns at w in its own axes, and by omega against the IMU: the IMU turns at R w - omega. A foot that stands does not turn.
void LegClock::add_rates(const JointSample& s, const LowLevel& low_level) {
  std::array<Eigen::Vector3d, 2> candidates;
  std::size_t count = 0;
  for (LinkKinematics& link : links_) {
    const auto motion = link.at(s);
    if (!motion || (with_gyro_ && !low_level.gyro)) return;
    candidates[count++] = motion->T_IL.R * (with_gyro_ ? *low_level.gyro : Eigen::Vector3d(Eigen::Vector3d::Zero())) - motion->omega;
  }
  rates_.add(s.t, std::span(candidates).first(count));
}

}  // namespace kilvo::lab
