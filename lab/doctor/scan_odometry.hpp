// The LiDAR's motion by its sweeps alone: each is registered to the planes of those before. Without a gyro the sweeps are taken as rigid,
// so that neither mounts nor point times can spoil it; with one, the motion within a sweep is removed.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "kilvo/math/se3.hpp"
#include "lab/doctor/gyro_path.hpp"

namespace kilvo::lab {

struct SweepPose {
  double t = 0;  // s, middle of the sweep on the LiDAR's clock
  double begin = 0, end = 0;
  SE3 T_WL;                                       // LiDAR in its first frame
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();  // m/s
  double thickness = 0;                           // m, robust distance of the points from the planes
  double weakest = 0;  // least information about a direction of translation, of 1 when all normals point alike in all directions
  bool good = false;
};

class LidarWay;

/// What is known of the motion within a sweep: its turning by the gyro and, from a way that was found before, how the velocity changes.
struct Deskew {
  const GyroPath* gyro = nullptr;
  SO3 R_IL;
  double offset = 0;              // s: the LiDAR's stamps plus this are on the IMU's clock
  double times = 1;               // hypothesis: what the points' times, from the middle of the sweep, have to be multiplied by
  const LidarWay* way = nullptr;  // none: constant velocity within a sweep
  Eigen::Vector3d p_IL = Eigen::Vector3d::Zero();
  // Every point is registered, to planes of more of a wall, and none at grazing incidence, where ranges are wrong: several times as long.
  bool exact = false;
};

struct OdometryRange {
  std::size_t begin = 0, end = SIZE_MAX;  // sweeps
};

/// One sweep after the other to the surroundings that those before have seen.
struct SweepRegistration {
  virtual ~SweepRegistration() = default;
  virtual SweepPose step(const Sweep& sweep, const Deskew& deskew) = 0;
};

/// The way so far and the surroundings to which it was registered: sweeps that follow continue both.
class ScanOdometry {
 public:
  /// Registers those of `sweeps` that follow the ones of before, which they begin with; else begins anew.
  void extend(const std::vector<Sweep>& sweeps, const Deskew& deskew);
  const std::vector<SweepPose>& way() const { return way_; }

 private:
  std::unique_ptr<SweepRegistration> registration_;
  std::vector<SweepPose> way_;
};

std::vector<SweepPose> scan_odometry(const std::vector<Sweep>& sweeps, const Deskew& deskew, OdometryRange range = {});

}  // namespace kilvo::lab
