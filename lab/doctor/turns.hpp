// How a sensor turned, interval by interval, held against the gyro: from that follow its mount's rotation, its clock and the gyro's axes.
#pragma once

#include <optional>
#include <vector>

#include "lab/doctor/gyro_path.hpp"
#include "lab/doctor/robust_fit.hpp"

namespace kilvo::lab {

/// From `a` to `b` (s, on the sensor's clock) a sensor turned by one of these rotation vectors (rad, in its own frame): a LiDAR has one,
/// legs have one for each foot that might stand.
struct Turn {
  double a = 0, b = 0;
  Eigen::Vector3d theta[2];
  int choices = 1;
};

/// What the gyro says of the same intervals.
struct TurnAgreement {
  Eigen::Matrix3d axes =
      Eigen::Matrix3d::Identity();  // orthogonal: takes the sensor's frame to the gyro's; of determinant -1 when one is left-handed
  double scale = 1;                 // of the gyro, against the sensor
  double explained = 0;             // share of the sensor's turning that the gyro explains with these axes, 0 to 1
  double turning = 0;               // rad/s, rms of the gyro's rate
  double weakest = 0;               // rad/s, rms about the axis that it turned about least
  std::size_t count = 0;
};

/// The best orthogonal matrix between sensor and gyro when the sensor's clock is `offset` behind.
TurnAgreement agree(const std::vector<Turn>& turns, const GyroPath& gyro, double offset);

/// The share explained with these axes, as they are.
double explained_by(const std::vector<Turn>& turns, const GyroPath& gyro, double offset, const Eigen::Matrix3d& axes, double scale = 1);

/// Offsets (s) at which both turn at the same time, the likeliest first; needs no axes and no units. Empty: nothing turns enough.
std::vector<double> likely_offsets(const std::vector<Turn>& turns, const GyroPath& gyro, double reach = 1.3);

struct MountFit {
  Fit fit;                                         // rotation of the mount (3), offset (1), gyro bias (3), and more
  SO3 R;                                           // takes the sensor's frame to the IMU's
  double offset = 0;                               // s: the sensor's stamps plus this are on the IMU's clock
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();  // rad/s
  double explained = 0;
  // By how much more than the sensor the gyro turns about each axis, as a share; known after refine_mount() only.
  Eigen::Vector3d gyro_excess = Eigen::Vector3d::Zero(), gyro_excess_sigma = Eigen::Vector3d::Constant(INFINITY);
  Eigen::Vector3d rotation_sigma() const { return {fit.sigma(0), fit.sigma(1), fit.sigma(2)}; }
  double offset_sigma() const { return fit.sigma(3); }
};

/// Refines both from a start within some degrees and 20 ms or so.
MountFit fit_mount(const std::vector<Turn>& turns, const GyroPath& gyro, const SO3& R, double offset, double rotation_prior = INFINITY);

/// The same, some times as precise, of a sensor whose turns follow each other: each one's noise is predicted from those before, as what is
/// off at the end of one is off at the beginning of the next; and what is wrong with the gyro (sensitivity to acceleration, scales and
/// skew of its axes) is a part of the search, so that the mount is not taken for it. `start`: see fit_mount().
MountFit refine_mount(const std::vector<Turn>& turns, const GyroPath& gyro, const MountFit& start);

/// The gyro's turning through that of a sensor of one choice, and its standard deviation: the sensor's noise does not make it smaller.
std::pair<double, double> gyro_scale(const std::vector<Turn>& turns, const GyroPath& gyro, const MountFit& fit);

/// The half of the intervals that a fit explains best: where a foot that is reported to stand does not roll.
std::vector<Turn> best_half(const std::vector<Turn>& turns, const GyroPath& gyro, const MountFit& fit);

/// Seconds of a block in whose scatter uncertainties are counted.
inline constexpr double block_seconds = 1.0;

}  // namespace kilvo::lab
