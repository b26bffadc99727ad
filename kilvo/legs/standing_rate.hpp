// The gyro's bias from two feet in stance: its rate beyond the rotation that both soles measure.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>

#include "kilvo/legs/contact_estimator.hpp"
#include "kilvo/legs/leg_kinematics.hpp"

namespace kilvo {

/// A measurement of the gyro's bias, each axis of the IMU, rad/s.
struct GyroBiasReading {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  double sigma = 0;
};

/// The angle between the integrated gyro and the soles grows by the bias. A body that sways on compliant soles and
/// encoders of coarse steps leave an error that does not grow: the bias is the slope of the line through the angle over the whole stand,
/// and what the angle deviates from that line gives its sigma.
class StandingRate {
 public:
  /// One leg sample; `gyro` as measured, rad/s. A reading of what is new, whenever the information of the standing phase has grown enough.
  std::optional<GyroBiasReading> add(const Feet& feet, const Contacts& contacts, const Eigen::Vector3d& gyro);

 private:
  static constexpr std::size_t most = 128;  // blocks of a stand
  void begin_block(const Feet& feet);
  void close_block(const Feet& feet);
  GyroBiasReading line(std::size_t first) const;
  std::optional<GyroBiasReading> news();

  bool stands_ = false;
  Time begin_{}, last_{};    // of the block, of the last sample
  std::array<SO3, 2> R_IF_;  // at the beginning of the block
  Eigen::Vector3d turned_ = Eigen::Vector3d::Zero();
  // At the ends of the blocks, since the stand began.
  struct Angles {
    double time = 0;                                   // s
    Eigen::Vector3d beyond = Eigen::Vector3d::Zero();  // of the gyro beyond the soles, rad
    Eigen::Vector3d soles = Eigen::Vector3d::Zero();   // turn of the body as the soles see it
    Eigen::Vector3d apart = Eigen::Vector3d::Zero();   // half of what they do not agree upon
  };
  std::array<Angles, most> angles_{};
  std::size_t count_ = 0;
  GyroBiasReading said_;  // of this stand; sigma 0: nothing
};

}  // namespace kilvo
