// Where the LiDAR sits on the IMU, from the innovations of a filter of both. The filter believes the described mount. How the error
// of its state depends on the mount, on the LiDAR's clock and on the axes of the IMU is propagated with it; its innovations are then a
// linear regression on these, as exact as with all of them in the state (B. Friedland, "Treatment of bias in recursive filtering", 1969).
#pragma once

#include <optional>
#include <span>

#include "kilvo/filter/state.hpp"
#include "kilvo/sensors/measurement.hpp"

namespace kilvo::lab {

/// True less described mount.
struct MountMeasurement {
  Eigen::Matrix<double, 6, 1> error;  // turn, rad, and shift, m, in the IMU frame: T_imu_lidar is (Exp(turn) R, p + shift)
  PoseCovariance covariance;
};

/// Of that, what a description is expected to be off by: it was calibrated, designed, or measured by hand, each as likely beforehand, and
/// its turn is as exact as its shift. `turned`: by how much the described rotation was wrong (rad) before it was corrected. None when it
/// was probably calibrated, and of a shift that no description is off by.
std::optional<Eigen::Vector3d> expected_shift(const MountMeasurement& measured, const Eigen::Vector3d& turned);

class MountRegression {
 public:
  explicit MountRegression(const SE3& T_imu_lidar) : T_IL_(T_imu_lidar) {}

  /// A sweep took the estimate from `prior` to `posterior`. `prior` was predicted from `from` with these samples of the IMU, the first not
  /// after `from`, the last not before `prior`, and with nothing else.
  void add(const Estimate& from, const Estimate& prior, const Estimate& posterior, std::span<const ImuSample> imu);

  /// None before 13 seconds of sweeps.
  std::optional<MountMeasurement> measured() const;

 private:
  // What is estimated: the mount (turn, shift), the clock (s, to be added to the stamps), and, column by column, the relative errors of the
  // axes of accelerometer and gyro, and what acceleration adds to the rate, rad/s per m/s^2.
  struct of {
    static constexpr int turn = 0, shift = 3, clock = 6, accel = 7, gyro = 16, push = 25, size = 34;
  };
  static constexpr int states = at::pcl;  // without feet and exposure
  using Parameters = Eigen::Matrix<double, of::size, 1>;
  using ParameterMatrix = Eigen::Matrix<double, of::size, of::size>;
  using PoseJacobian = Eigen::Matrix<double, 6, of::size>;

  void begin(const Estimate& e, const Eigen::Vector3d& rate);
  void propagate(const Estimate& from, Time until, std::span<const ImuSample> imu);
  PoseJacobian of_pose(const State& x, const Eigen::Vector3d& rate) const;
  struct Solution {
    Parameters x;
    ParameterMatrix covariance;
  };
  Solution solved(double mount) const;  // beforehand it is off by so much, rad and m

  SE3 T_IL_;
  std::optional<Estimate> last_;
  Eigen::Matrix<double, states, of::size> D_;  // how what is true less what is estimated depends on the parameters
  Eigen::Vector3d resting_force_;              // m/s^2: what is wrong with that is a bias
  PoseJacobian of_map_;                        // of the poses that the map began with, as twists at the world's origin
  // The regression: normal equations, and the squares of their right side in blocks.
  ParameterMatrix N_ = ParameterMatrix::Zero(), scatter_ = ParameterMatrix::Zero();
  Parameters n_ = Parameters::Zero(), block_ = Parameters::Zero(), expected_ = Parameters::Zero();
  Time begun_{}, block_begin_{};
  int blocks_ = 0;
};

}  // namespace kilvo::lab
