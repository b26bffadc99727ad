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

/// Velocity of a contact point, averaged over the correlation time of its noise: a sole that rolls, slides, gives way or is measured badly
/// does so for all of that time. Never less than the settings say.
class SoleNoise {
 public:
  explicit SoleNoise(const LegConfig& config);

  /// `velocity_W`: of the point on which this foot stands, m/s; `up_W`: unit vector against gravity; `sigma_v`: of the state's velocity,
  /// m/s, while nothing but the legs measures it.
  void add(std::size_t side, const Eigen::Vector3d& velocity_W, const Eigen::Vector3d& up_W, double dt,
           std::optional<double> sigma_v = std::nullopt);
  /// The foot leaves, or stands on another place.
  void interrupt(std::size_t side) { sum_[side] = {}; }
  /// What was seen before is of another state.
  void restart();

  double horizontal() const;  // standard deviation of each axis, m/s
  double vertical() const;    // m/s

  /// Once: the vertical velocity (m/s, upwards) that both soles seem to have, when that is an error of the state. A sole may roll and
  /// slide, but the ground holds its height: what both seem to do, one after the other, shows a push that the IMU has not measured.
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
  std::array<std::optional<double>, 2> last_rise_;  // m/s, the last average of each foot
  double usual_rise_ = 0, rises_ = 0;               // m/s, of the last averages; how many
  std::optional<double> rise_;
};

}  // namespace kilvo
