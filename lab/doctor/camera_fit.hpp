// The camera against the gyro: with the rotation between two images known and the way too, each track must lie in its epipolar plane.
#pragma once

#include <vector>

#include "kilvo/sensors/robot.hpp"
#include "lab/doctor/gyro_path.hpp"
#include "lab/doctor/robust_fit.hpp"
#include "lab/doctor/scan_odometry.hpp"

namespace kilvo::lab {

/// Where the IMU is, from the LiDAR's way; between sweeps the specific force says how it got from one to the next.
class LidarWay {
 public:
  /// `offset`: the LiDAR's stamps plus this are on the IMU's clock. `imu`: in the IMU frame, SI units. `g_W`, `ba`: of a TranslationFit.
  LidarWay(const std::vector<SweepPose>& poses, const SE3& T_IL, double offset, const std::vector<InertialSample>& imu,
           const GyroPath& gyro, const Eigen::Vector3d& g_W, const Eigen::Vector3d& ba);
  bool empty() const { return poses_.size() < 2; }
  /// Pose of the IMU at a time on its own clock; none outside or in gaps.
  std::optional<SE3> at(double t, const GyroPath& gyro) const;

  struct Pose {
    double t;
    SE3 T_WI;
  };

 private:
  void add(std::vector<Pose>& run, const std::vector<InertialSample>& imu, const GyroPath& gyro, const Eigen::Vector3d& g_W,
           const Eigen::Vector3d& ba);
  std::vector<Pose> poses_;  // at every IMU sample
};

struct CameraGuess {
  CameraMount mount;
  double offset = 0;  // s: the images' stamps plus this are on the IMU's clock
};

struct CameraFit {
  // Rotation (3, camera frame), log of the focal length (1), offset (1); with the position that (3, IMU frame, m), or with the lens that
  // (5): principal point (2, focal lengths), log of fy / fx, k1, k2.
  Fit fit;
  SO3 R_IC;
  Eigen::Vector3d p_IC = Eigen::Vector3d::Zero();  // m
  double focal = 1;                                // times the focal lengths of the guess
  double offset = 0;                               // s
  CameraMount mount;                               // with all that was found
  double error = 0;                                // px, robust standard deviation across the epipolar lines
};

class CameraTracks {
 public:
  CameraTracks(const std::vector<TrackedPair>& tracks, const GyroPath& gyro, const LidarWay* way);
  std::size_t pairs() const { return pairs_.size(); }
  double turning() const { return turning_; }  // rad/s, rms over the pairs
  /// px: robust distance from the epipolar lines under a guess; infinite when it cannot be judged.
  double error(const CameraGuess& guess) const;
  CameraFit fit(const CameraGuess& guess, bool with_focal, bool with_offset) const;
  /// Of focal length and offset alone.
  CameraFit fit_unturned(const CameraGuess& guess) const { return fit(guess, {true, true, false, false, false}); }
  /// Of all of it, the position included: the camera turns with the robot, and so goes a way of its own. Only the LiDAR's way shows that.
  CameraFit fit_with_position(const CameraGuess& guess) const;
  /// Of all of it but the position, with the lens: principal point, fy against fx and radial distortion.
  CameraFit fit_with_lens(const CameraGuess& guess) const;
  /// The best of all rotations, whatever that of the guess.
  CameraFit fit_any_rotation(const CameraGuess& guess) const;
  /// Offsets at which the images' motion is strong when the gyro's is; the likeliest first.
  std::vector<double> likely_offsets(double reach) const;

 private:
  struct Free {
    bool focal, offset, position, lens = false, rotation = true;
  };
  CameraFit fit(const CameraGuess& guess, const Free& free) const;
  void residuals(const CameraGuess& guess, const std::vector<std::vector<Eigen::Vector4d>>& rays, const SE3& T_IC, double focal,
                 double offset, std::size_t stride, Residuals& out) const;
  std::vector<std::vector<Eigen::Vector4d>> rays_of(const CameraMount& mount) const;

  std::vector<const TrackedPair*> pairs_;
  const GyroPath& gyro_;
  const LidarWay* way_;
  double turning_ = 0;
};

}  // namespace kilvo::lab
