// Whether what the senses say can be true together. What cannot is reported with the two that contradict each other.
#include <algorithm>
#include <cmath>
#include <string>

#include "kilvo/estimator/decimals.hpp"
#include "kilvo/estimator/estimator.hpp"

namespace kilvo {
namespace {

// What differs from the biases at the start by more than this is no bias: of a sensor that drifts, and of none at all, m/s^2, rad/s.
constexpr double strange_accel = 0.3, impossible_accel = 0.8, strange_gyro = 0.03, impossible_gyro = 0.1;
// Three times the speed at which no leg of this length can walk (Froude number 1): nobody runs faster either.
constexpr double fastest = 3.0;
// So many times within so long nothing stood still under the robot, and the velocity was given up.
constexpr std::uint64_t most_lost_stances = 3;
constexpr Duration remembered = std::chrono::seconds(10);

const char* words_for(Sensor s) {
  constexpr const char* words[] = {"the IMU", "the legs", "the LiDAR", "the camera"};
  return words[static_cast<int>(s)];
}

}  // namespace

void Estimator::contradict(Reason reason, Sensor a, Sensor b, double value, const std::string& why) {
  if (reason == Reason::diverged) statistics_.diverged = true;
  report({}, reason, value, std::string(words_for(a)) + " and " + words_for(b) + " contradict each other: " + why);
}

// Which other sense carried the estimate until now.
Sensor Estimator::witness_against(Sensor s) const {
  if (s != Sensor::legs && last_legs_ && estimate_->t - last_used_stance_ < std::chrono::seconds(5)) return Sensor::legs;
  if (s == Sensor::imu && has_lidar(modality_)) return Sensor::lidar;
  if (s == Sensor::imu && last_legs_) return Sensor::legs;
  return Sensor::imu;
}

void Estimator::look_at_agreement(Time t) {
  if (agreement_looked_at_ == Time{}) {
    first_ba_ = estimate_->x.ba;
    first_bg_ = estimate_->x.bg;
    agreement_looked_at_ = t;
    return;
  }
  judge_speed();
  judge_biases();
  if (t - agreement_looked_at_ < remembered) return;
  agreement_looked_at_ = t;
  const std::uint64_t lost = statistics_.lost_stances - lost_stances_before_;
  lost_stances_before_ = statistics_.lost_stances;
  if (lost >= most_lost_stances && !statistics_.diverged)
    contradict(Reason::diverged, Sensor::legs, has_lidar(modality_) ? Sensor::lidar : Sensor::imu, static_cast<double>(lost),
               "for seconds no foot seemed to stand still, and the velocity was given up " + std::to_string(lost) + " times in 10 s");
}

void Estimator::judge_speed() {
  const double speed = estimate_->x.v.norm(), limit = fastest * std::sqrt(standard_gravity * leg_length_);
  const double sigma = std::sqrt(std::max(0.0, estimate_->P.diagonal().segment<3>(at::v).maxCoeff()));
  if (speed < limit || sigma > 0.3 * speed || statistics_.diverged) return;
  contradict(Reason::diverged, Sensor::imu, has_lidar(modality_) ? Sensor::lidar : Sensor::legs, speed,
             "together they say a speed of " + decimals(speed, 1) + " m/s");
}

void Estimator::judge_biases() {
  const double accel = (estimate_->x.ba - first_ba_).norm(), gyro = (estimate_->x.bg - first_bg_).norm();
  const bool impossible = accel > impossible_accel || gyro > impossible_gyro;
  if (impossible ? statistics_.diverged : (strange_biases_ || (accel < strange_accel && gyro < strange_gyro))) return;
  strange_biases_ = true;
  const std::string why = "the biases that would reconcile them have changed since the start by " + decimals(accel, 2) + " m/s^2 and " +
                          decimals(gyro, 3) + " rad/s: is the mount right?";
  contradict(impossible ? Reason::diverged : Reason::inconsistent, Sensor::imu, has_lidar(modality_) ? Sensor::lidar : Sensor::legs, accel,
             why);
}

}  // namespace kilvo
