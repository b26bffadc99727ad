// Where the LiDAR sits on the IMU, and whether the accelerometer's axes are what they seem, from the LiDAR's way and the specific force.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "lab/doctor/robust_fit.hpp"
#include "lab/doctor/scan_odometry.hpp"

namespace kilvo::lab {

inline constexpr double gravity = 9.80665;  // m/s^2

struct TranslationFit {
  Eigen::Vector3d r = Eigen::Vector3d::Zero();                            // LiDAR in the IMU frame, m
  Eigen::Vector3d g_W = Eigen::Vector3d::Zero();                          // gravity in the frame of the LiDAR's way, m/s^2
  Eigen::Vector3d ba = Eigen::Vector3d::Zero();                           // m/s^2
  Eigen::Matrix<double, 9, 9> cov = Eigen::Matrix<double, 9, 9>::Zero();  // of the three
  double rms = 0;                                                         // m/s, robust, of a row
  std::size_t rows = 0;
  double sigma_r(int i) const;
};

/// A way through that of the accelerometer.
struct WayScale {
  double factor = 1, sigma = INFINITY;
  /// The accelerometer's noise makes a slope of least squares too small: were it all that is not explained, it would be this (at least
  /// `factor`).
  double most = INFINITY;
  /// How far (in standard deviations) it is from a factor, which noise may have made smaller.
  double distance_to(double other) const { return std::max({0.0, factor - other, other - most}) / sigma; }
};

/// The rows of p_{k+1} - 2 p_k + p_{k-1} against the doubly integrated specific force, for any axes of the accelerometer.
class TranslationRows {
 public:
  /// `offset`: the LiDAR's stamps plus this are on the IMU's clock.
  TranslationRows(const std::vector<SweepPose>& poses, const std::vector<InertialSample>& imu, const GyroPath& gyro, const SO3& R_IL,
                  double offset);
  std::size_t size() const { return rows_.size(); }
  /// `axes`: takes what the accelerometer wrote to m/s^2 in the IMU frame. None with too few rows.
  std::optional<TranslationFit> fit(const Eigen::Matrix3d& axes) const;
  /// Of the sensor's way against the acceleration, from a fit with the same axes.
  WayScale scale(const Eigen::Matrix3d& axes, const TranslationFit& from) const;
  /// The same with a place of the LiDAR that is some times as precise: an accelerometer's axes may be a little off, and each row's noise is
  /// predicted from those before (L. Ljung, "System identification", 1999, prediction errors): the noise of a place is in three rows.
  std::optional<TranslationFit> refine(const Eigen::Matrix3d& axes) const;

 private:
  struct Row {
    double t, dt, before, after;  // s: of the sweep, mean of the two intervals, each of them
    bool follows;                 // the row before is of the sweep before
    // What is left of the squared velocities that samples beyond gravity add: in this row, and in common with the row before. (m/s)^2
    double pushed, shared;
    Eigen::Matrix3d H_r, H_ba;
    Eigen::Vector3d y;
    Eigen::Matrix<double, 3, 9> force;  // of each element of the axes, row by row
  };
  struct Equations;
  Equations equations(const Eigen::Matrix3d& axes, bool free_axes) const;
  /// For a noise of one metre of each place: density of the acceleration, 1/s^1.5, and error of what is beyond gravity, 1/m.
  struct Noise {
    double accel, push;
  };
  Equations whitened(const Equations& of, const Noise& noise) const;
  struct Solution {
    Eigen::VectorXd x;
    Eigen::MatrixXd cov;
    double scale = 0;     // robust standard deviation of a row
    double unlikely = 0;  // minus the mean logarithm of the likelihood
  };
  std::optional<Solution> solve(const Equations& of) const;
  std::vector<Row> rows_;
};

/// The 48 signed permutations: the identity first, then by how many signs and places differ.
std::vector<Eigen::Matrix3d> signed_permutations();
/// The nearest of them.
Eigen::Matrix3d nearest_permutation(const Eigen::Matrix3d& m);
/// "+x -y +z": which axis of the first frame each axis of the second is.
std::string axes_text(const Eigen::Matrix3d& permutation);

}  // namespace kilvo::lab
