// What is wrong with the description of a camera, as its images show where sweeps hold the pose. A camera that is mounted or stamped
// otherwise than described turns its images as a whole; one of another focal length, distortion or place shows another share of the way.
// Patches that miss their places by that are no outliers: the few that happen to fit would confirm whatever the prior says.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>
#include <span>

#include "kilvo/filter/innovation.hpp"
#include "kilvo/filter/measurement_rows.hpp"
#include "kilvo/filter/state.hpp"
#include "kilvo/map/visual_map.hpp"
#include "kilvo/math/running_statistics.hpp"
#include "kilvo/vision/mount_check.hpp"

namespace kilvo {

class CameraErrors {
 public:
  explicit CameraErrors(const SE3& T_imu_camera) : R_described_(T_imu_camera.R), T_CI_(T_imu_camera.inverse()) {}

  /// As described, but for what was corrected since.
  const SE3& T_CI() const { return T_CI_; }

  /// The turns of the body that an image shows against the frames of `map`. `expected`: variance of the prior's part, all axes.
  void add_turns(const MountCheck::View& image, const VisualMap& map, std::span<const ImageTurn> turns, double expected);
  /// An image measures `info` at the iterate `x`, where sweeps hold `prior`; `way`: from its frames, m.
  void add_way(const Information<7>& info, const State& x, const Estimate& prior, const Eigen::Vector3d& way);
  /// How much farther from its frames than for the sweeps an image shows the robot, m, of the variance that is expected, after `way`, m.
  void add_shift(double shift, double variance, double way);

  /// Of a turn of the image about each axis, common to all of its patches, rad^2. That it is alike in images in a row is for excess().
  double turn_variance() const { return std::max(0.0, turn_.mean()); }
  /// Of the error of the distance from earlier images, per distance^2; the same for images in a row.
  double way_variance() const { return std::max(0.0, way_.mean()); }
  /// `e` with the variance of that turn in that of its rotation.
  Estimate with_turn(Estimate e) const;
  /// Of the images' innovations, beyond that.
  InnovationScale& excess() { return excess_; }

  struct Turned {
    Eigen::Vector3d by = Eigen::Vector3d::Zero();  // of the camera against the description, about the IMU's axes, rad
    std::optional<SO3> corrected;                  // the camera's rotation in the IMU frame from now on
  };
  /// Whether the mount is another one than described. What a careful description may be off by is corrected. With more the camera is not
  /// used for some time from `t` on, each time for longer: the cause of a false alarm may have passed.
  std::optional<Turned> judge(Time t);
  bool refuses(Time image) const { return image < refused_until_; }
  /// s, to be added to the stamps of the images, if they are sure to be off.
  std::optional<double> clock_offset();
  void restart() { check_ = MountCheck(); }

 private:
  static constexpr double doubtful = 10, memory = 300;  // images
  SO3 R_described_;
  SE3 T_CI_;
  MountCheck check_;
  RunningStatistics turn_{0, 0, doubtful, memory}, way_{0, 0, doubtful, memory};
  InnovationScale excess_;
  Time refused_until_{};
  Duration pause_{};  // the last one
};

}  // namespace kilvo
