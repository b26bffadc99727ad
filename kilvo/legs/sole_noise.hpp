// How still the soles of this robot stand, as its filter sees them: learnt from its stances.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <utility>

#include "kilvo/legs/leg_config.hpp"
#include "kilvo/math/running_statistics.hpp"

namespace kilvo {

/// Velocity of a contact point, averaged over the correlation time of its noise: a sole that rolls, slides, deforms or is measured badly
/// does so for all of that time. Never less than the settings (of the vertical, once a LiDAR has shown it, of the horizontal).
///
/// While nothing but the legs measures the vertical velocity, noise and error of the state are separated as by Mehra (1970): the noise
/// of a stance is its own, so that what successive stances of opposite feet have in common is an error of the state.
class SoleNoise {
 public:
  explicit SoleNoise(const LegConfig& config);

  /// `velocity_W`: of the point on which this foot stands, m/s; `up_W`: unit vector against gravity; `sigma_v`: what the vertical velocity
  /// of the state may be wrong by, m/s, while nothing but the legs measures it.
  void add(std::size_t side, const Eigen::Vector3d& velocity_W, const Eigen::Vector3d& up_W, double dt,
           std::optional<double> sigma_v = std::nullopt);
  /// The foot leaves, or stands on another place.
  void interrupt(std::size_t side) { sum_[side] = {}; }
  /// What was seen before is of another state.
  void restart();

  double horizontal() const;  // standard deviation of each axis, m/s
  double vertical() const;    // m/s

  /// Once: by how much more the vertical velocity of the state may be wrong than it reports, m/s (one standard deviation). A sole may roll
  /// and slide, but the ground holds its height: what both seem to do, one after the other, shows a push that the IMU has not measured.
  std::optional<double> take_rise() { return std::exchange(rise_, std::nullopt); }

 private:
  void add_rise(std::size_t side, double up, double variance_v);
  struct Sum {
    Eigen::Vector3d way = Eigen::Vector3d::Zero();  // m
    double time = 0;                                // s
  };
  LegConfig config_;
  std::array<Sum, 2> sum_;
  RunningStatistics across_, upwards_;              // squares, (m/s)^2
  RunningStatistics alike_;                         // products of successive averages of opposite feet, (m/s)^2
  std::array<std::optional<double>, 2> last_rise_;  // m/s, the last average of each foot
  std::optional<double> rise_;
  bool knows_vertical_ = false;  // something else than the legs has measured it
};

}  // namespace kilvo
