// The sweeps of the LiDAR: its way by them, and the times of their points.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "lab/doctor/examination.hpp"

namespace kilvo::lab {
namespace {

constexpr double believable = 0.2;  // m/s, that the acceleration and the way may be apart by

}  // namespace

std::vector<Turn> turns_of(const std::vector<SweepPose>& way) {
  std::vector<Turn> out;
  for (std::size_t i = 1; i < way.size(); ++i) {
    const SweepPose &a = way[i - 1], &b = way[i];
    if (a.good && b.good && b.t - a.t < 0.6 && b.t > a.t)
      out.push_back({a.t, b.t, {(a.T_WL.R.inverse() * b.T_WL.R).Log(), Eigen::Vector3d::Zero()}, 1});
  }
  return out;
}

// Rigid ones, so that neither mount nor clock can spoil it; or deskewed by the gyro as described, if they turn as it does then.
void Examination::register_sweeps() {
  if (recorded_.sweeps.empty()) return;
  if (described_first_) {
    if (earlier_.origin != recorded_.origin) earlier_ = {earlier_.point_times_are_good, recorded_.origin, {}, {}};
    const GyroPath path = gyro();
    earlier_.described.extend(recorded_.sweeps, {&path, robot_.lidar.T_imu_lidar.R});
    turn_with(earlier_.described.way());
    deskewed_ = lidar_.known && lidar_.agrees;
    if (deskewed_ || !lidar_.turned) return;
  }
  turn_with(scan_odometry(recorded_.sweeps, {}));
}

void Examination::turn_with(std::vector<SweepPose> way) {
  constexpr double least_explained = 0.8;
  first_ = std::move(way);
  lidar_turns_ = turns_of(first_);
  lidar_ = agreement(lidar_turns_, robot_.lidar.T_imu_lidar.R, least_explained);
}

// Deskewed with the right times the surroundings are sharpest.
void Examination::examine_point_times() {
  double span = 0;
  for (const Sweep& s : recorded_.sweeps) span = std::max(span, s.end - s.begin);
  const bool at_once = recorded_.reading.without_deskew;
  if (span < 1e-4 && !at_once) {
    find({Sensor::lidar,
          "point_times_absent",
          "all points of a sweep have the same time",
          fmt::format("the longest sweep lasts {:.3f} ms by its points", 1e3 * span),
          "the driver must publish point times (or lidar.deskew: false for a LiDAR that measures at once)",
          span,
          "s",
          {},
          true});
    return;
  }
  const GyroPath path = gyro();
  Deskew deskew{&path, robot_.lidar.T_imu_lidar.R};
  deskew_first(deskew);
  if (at_once) check(Sensor::lidar, "point times", Check::Verdict::note, "not used: each cloud is taken at its stamp (lidar.deskew)");
  if (!at_once && !earlier_.point_times_are_good) deskew.times = right_point_times(deskew);
  if (deskew.times != 1) way_ = scan_odometry(recorded_.sweeps, deskew);
  // Once more with the mount and the clock that follow: sweeps taken as rigid shift both a little.
  const MountFit again = fit_mount(turns_of(way_), path, deskew.R_IL, deskew.offset);
  if (!again.fit.good) return;
  gyro_bias_ = again.bias;
  const GyroPath better = gyro();
  deskew.gyro = &better;
  deskew.R_IL = again.R;
  deskew.offset = again.offset;
  // What the acceleration says of the velocity within a sweep; with a wrong description it fits nothing, and is left out.
  const auto fit = TranslationRows(way_, recorded_.imu, better, again.R, again.offset).fit(accel_axes_);
  // A place that is hardly known would make the way that it is measured by.
  SE3 T_IL{again.R, robot_.lidar.T_imu_lidar.p};
  for (int i = 0; fit && i < 3; ++i) {
    if (std::abs(fit->r[i] - T_IL.p[i]) > sure * fit->sigma_r(i)) T_IL.p[i] = fit->r[i];
  }
  const LidarWay swung(fit && fit->rms < believable ? way_ : std::vector<SweepPose>{}, T_IL, again.offset, mended_imu(), better,
                       fit ? fit->g_W : Eigen::Vector3d::Zero(), fit ? fit->ba : Eigen::Vector3d::Zero());
  deskew.way = swung.empty() ? nullptr : &swung;
  deskew.p_IL = T_IL.p;
  deskew.exact = recorded_.reading.all_points;
  earlier_.swung.extend(recorded_.sweeps, deskew);
  way_ = earlier_.swung.way();
}

// By the gyro under the mount and the clock that rigid sweeps tell, unless that was done with the described ones.
void Examination::deskew_first(Deskew& deskew) {
  if (deskewed_) {
    way_ = first_;
    return;
  }
  const SO3 start = SO3::nearest(lidar_.error * deskew.R_IL.matrix());
  const MountFit fit = fit_mount(lidar_turns_, *deskew.gyro, start, lidar_.offset);
  deskew.R_IL = fit.fit.good ? fit.R : start;
  deskew.offset = fit.fit.good ? fit.offset : lidar_.offset;
  way_ = scan_odometry(recorded_.sweeps, deskew);
}

}  // namespace kilvo::lab
