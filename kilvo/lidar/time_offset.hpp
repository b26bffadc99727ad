// By how much a LiDAR's stamps are off the IMU's. If they are, each sweep shows how the robot looked at another time, and turns the state
// by the offset times what the angular rate has changed by since the sweep before. That is a regression over the last sweeps.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace kilvo {

class TimeOffset {
 public:
  /// A sweep at whose middle the body turned at `rate` (rad/s, mean over the sweep) turned the state by `turned` (rad); both in the body.
  void add(const Eigen::Vector3d& turned, const Eigen::Vector3d& rate);

  /// s, to be added to the stamps, if the sweeps so far are sure that they are off by more than `least`. To be corrected and looked for
  /// again: the state follows the sweeps, so that what is found is near what there is and no more.
  std::optional<double> offset(double least) const;

  /// There may be an offset.
  bool is_doubtful() const;

  /// Sweeps from now on have other stamps.
  void restart() { *this = TimeOffset(); }

 private:
  std::optional<double> beyond(double least, double sigmas) const;

  // Of (change of the rate, rate): a gyroscope whose scale is wrong looks like the second.
  Eigen::Matrix2d N_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d n_ = Eigen::Vector2d::Zero();
  double turned2_ = 0;
  double sweeps_ = 0;
  std::optional<Eigen::Vector3d> last_rate_;
};

}  // namespace kilvo
