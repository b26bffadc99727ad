// How still the soles of this robot stand, as its filter sees them: learnt from its stances.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "kilvo/legs/leg_config.hpp"
#include "kilvo/math/running_statistics.hpp"

namespace kilvo {

/// Velocity of a contact point, averaged over the correlation time of its noise: a sole that rolls, slides, gives way or is measured badly
/// does so for all of that time. Never less than the settings say.
class SoleNoise {
 public:
  explicit SoleNoise(const LegConfig& config);

  /// `velocity_W`: of the point on which this foot stands, m/s; `up_W`: unit vector against gravity.
  void add(std::size_t side, const Eigen::Vector3d& velocity_W, const Eigen::Vector3d& up_W, double dt);
  /// The foot leaves, or stands on another place.
  void interrupt(std::size_t side) { sum_[side] = {}; }

  double horizontal() const;  // standard deviation of each axis, m/s
  double vertical() const;    // m/s

 private:
  struct Sum {
    Eigen::Vector3d way = Eigen::Vector3d::Zero();  // m
    double time = 0;                                // s
  };
  LegConfig config_;
  std::array<Sum, 2> sum_;
  RunningStatistics across_, upwards_;  // squares, (m/s)^2
};

}  // namespace kilvo
