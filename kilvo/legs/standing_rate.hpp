// The gyro's bias from two feet that stand: what it says beyond the turn that both soles see.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "kilvo/legs/contact_estimator.hpp"
#include "kilvo/legs/leg_kinematics.hpp"

namespace kilvo {

/// A measurement of the gyro's bias, each axis of the IMU, rad/s.
struct GyroBiasReading {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  double sigma = 0;
};

class StandingRate {
 public:
  /// One leg sample; `gyro` as measured, rad/s. A reading at the end of each window in which both feet have stood.
  std::optional<GyroBiasReading> add(const Feet& feet, const Contacts& contacts, const Eigen::Vector3d& gyro);

 private:
  void begin(const Feet& feet);

  std::optional<Time> begin_;
  Time last_{};
  std::array<SO3, 2> R_IF_;  // at the beginning
  Eigen::Vector3d turned_ = Eigen::Vector3d::Zero(), squares_ = Eigen::Vector3d::Zero();
};

}  // namespace kilvo
