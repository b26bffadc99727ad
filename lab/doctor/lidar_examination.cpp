// The LiDAR: the rotation of its mount, its clock.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "lab/doctor/examination.hpp"

namespace kilvo::lab {
namespace {

// A careful mount reaches a tenth of this.
constexpr double lidar_rotation_tolerance = 0.7;  // degrees
constexpr double worth_a_note = 0.08;             // degrees
constexpr double lidar_clock_tolerance = 0.0035;  // s

// The same way as seen by a LiDAR whose points are mirrored.
std::vector<SweepPose> mirrored(std::vector<SweepPose> way, const Eigen::Matrix3d& M) {
  for (SweepPose& pose : way) {
    pose.T_WL = {SO3::nearest(M * pose.T_WL.R.matrix() * M), M * pose.T_WL.p};
    pose.v_W = M * pose.v_W;
  }
  return way;
}

}  // namespace

void Examination::examine_lidar() {
  const std::size_t clouds = recorded_.stamps[static_cast<std::size_t>(Sensor::lidar)].count;
  const double far_share = static_cast<double>(recorded_.far_points) / static_cast<double>(std::max<std::size_t>(recorded_.points, 1));
  constexpr double most_far = 0.9;
  const bool none_in_reach = recorded_.sweeps.size() < clouds / 10;
  if (clouds >= 30 && (none_in_reach || far_share > most_far)) {
    find({Sensor::lidar,
          "lidar_unit",
          none_in_reach ? std::string("hardly a point of the clouds is between 0.5 and 200 m: they are not in metres")
                        : fmt::format("most points of the clouds are farther than {:.0f} m: they are not in metres", far_away),
          fmt::format("{} of {} clouds have points between 0.5 and 200 m; {:.0f} % of all points are beyond {:.0f} m",
                      recorded_.sweeps.size(), clouds, 100 * far_share, far_away),
          "the driver must publish metres",
          0,
          "",
          {},
          true});
    return;
  }
  if (recorded_.sweeps.size() < 30) return;
  examine_lidar_range();
  if (!lidar_.known) {
    check(Sensor::lidar, "mount and clock", Check::Verdict::unknown,
          fmt::format("its sweeps do not turn as the gyro does under any mount ({:.0f} % explained), or hardly turn: walk and turn",
                      100 * lidar_.explained));
    return;
  }
  const std::size_t before = diagnosis_.findings.size();
  examine_point_times();
  const MountFit fit = examine_lidar_rotation();
  const std::string times = diagnosis_.findings.size() > before ? diagnosis_.findings[before].cause : "";
  // Without times a sweep is taken at its stamp: that half a sweep is missing is no fault of the clock.
  if (times == "point_times_absent" || way_.empty()) return;
  // Wrong times move the middle of a sweep: that is no fault of the clock either.
  if (times != "clouds_deskewed" && times != "point_times_unit") examine_lidar_clock(fit);
  examine_lidar_position();
}

// Limits of the range that leave hardly a point: of another unit.
void Examination::examine_lidar_range() {
  const LidarMount& lidar = robot_.lidar;
  std::size_t all = 0, within = 0, nearer = 0;
  for (const Sweep& sweep : recorded_.sweeps) {
    for (const TimedPoint& p : *sweep.points) {
      const auto range = static_cast<double>(p.p.norm());
      ++all;
      within += range >= lidar.min_range && range <= lidar.max_range ? 1 : 0;
      nearer += range < lidar.min_range ? 1 : 0;
    }
  }
  constexpr double fewest = 0.1;  // of the points
  const double share = static_cast<double>(within) / static_cast<double>(std::max<std::size_t>(all, 1));
  if (all == 0 || share > fewest) return;
  const LidarMount usual;
  const Change change =
      2 * nearer > all ? Change{"lidar.min_range", number_text(usual.min_range)} : Change{"lidar.max_range", number_text(usual.max_range)};
  find({Sensor::lidar,
        "lidar_range",
        fmt::format("{:.0f} % of the LiDAR's points are between lidar.min_range ({:g} m) and lidar.max_range ({:g} m)", 100 * share,
                    lidar.min_range, lidar.max_range),
        fmt::format("{} of {} points", within, all),
        change.key + ", in metres",
        share,
        "",
        {change},
        true});
}

// Which of two places of the LiDAR its way tells of: a mount that hardly turns may be off by what its inverse is.
bool Examination::lidar_is_nearer(const Eigen::Vector3d& p, const Eigen::Vector3d& other, const SO3& R_IL) const {
  const auto place = TranslationRows(way_, recorded_.imu, gyro(), R_IL, lidar_offset_).fit(accel_axes_);
  return place && (place->r - p).norm() < (place->r - other).norm();
}

MountFit Examination::examine_lidar_rotation() {
  const std::vector<Turn> turns = way_.empty() ? lidar_turns_ : turns_of(way_);
  if (way_.empty()) way_ = first_;
  const SO3 described = robot_.lidar.T_imu_lidar.R;
  const SO3 start = SO3::nearest(lidar_.error * described.matrix());
  const GyroPath path = gyro();
  const MountFit fit = refine_mount(turns, path, fit_mount(turns, path, start, lidar_.offset));
  if (!fit.fit.good) {
    check(Sensor::lidar, "rotation of the mount", Check::Verdict::unknown, "too few sweeps could be registered");
    return fit;
  }
  lidar_.offset = fit.offset;
  lidar_.error = (fit.R * described.inverse()).matrix();
  lidar_offset_ = fit.offset;
  examine_gyro_scale(turns, fit);
  refine_gyro_scale(fit);
  constexpr double method = 0.1;  // degrees: the gyro's own misalignment is taken for the mount's
  refine_rotation(Sensor::lidar, "rotation of the LiDAR on the IMU", described, fit.R, fit.rotation_sigma(), method, "lidar.T_imu_lidar.R");
  const Eigen::Vector3d turn = (fit.R * described.inverse()).Log();
  const double angle = degrees(turn.norm());
  const Eigen::Vector3d sigma = fit.rotation_sigma();
  const double uncertain = degrees(sigma.norm());
  const std::string detail = fmt::format("{:.2f} degrees from the description, standard deviation {:.2f}", angle, uncertain);
  if (angle < std::max(lidar_rotation_tolerance, sure * uncertain)) {
    const bool note = angle > worth_a_note && angle > 3 * uncertain;
    check(Sensor::lidar, "rotation of the mount",
          uncertain > 5 ? Check::Verdict::unknown
          : note        ? Check::Verdict::note
                        : Check::Verdict::good,
          detail + (note ? ": could be calibrated" : ""));
    seems_wrong(Sensor::lidar) |= angle > lidar_rotation_tolerance;
    return fit;
  }
  // Points that are mirrored turn as those of a LiDAR that is turned by half a turn do; their way differs.
  const Eigen::Matrix3d M = -(described.inverse() * fit.R).matrix();
  if (angle > 170 && (M * M).isApprox(Eigen::Matrix3d::Identity(), 0.1)) {
    const auto proper = TranslationRows(way_, recorded_.imu, gyro(), fit.R, lidar_offset_).fit(accel_axes_);
    const auto other = TranslationRows(mirrored(way_, M), recorded_.imu, gyro(), described, lidar_offset_).fit(accel_axes_);
    if (proper && other && other->rms < 0.6 * proper->rms) {
      find({Sensor::lidar,
            "lidar_axes",
            fmt::format("the LiDAR's points are mirrored (left-handed): {} would be right", axes_text(nearest_permutation(M))),
            fmt::format("way of the sweeps against the acceleration: {:.2f} m/s left then, {:.2f} m/s turned instead", other->rms,
                        proper->rms),
            "the driver must publish points in a right-handed frame",
            0,
            "",
            {},
            true});
      way_.clear();
      return fit;
    }
  }
  Finding f;
  f.sensor = Sensor::lidar;
  f.cause = "lidar_rotation";
  f.turn = turn;
  const SE3 inverse = robot_.lidar.T_imu_lidar.inverse();
  // A mount that hardly turns is nearly its own inverse: the two must differ by what is wrong.
  const bool turned_as_inverse =
      degrees((inverse.R * described.inverse()).Log().norm()) > 0.7 * angle &&
      degrees((fit.R * inverse.R.inverse()).Log().norm()) < std::min(0.3 * angle, std::max(0.15 * angle, 3 * uncertain));
  if (turned_as_inverse && lidar_is_nearer(inverse.p, robot_.lidar.T_imu_lidar.p, fit.R)) {
    f.text = fmt::format("the LiDAR's mount is given the wrong way round (lidar from IMU): {} off", turn_text(SO3::Exp(turn)));
    f.cause = "lidar_inverted";
    robot_.lidar.T_imu_lidar.p = inverse.p;
    f.changes.push_back({"lidar.T_imu_lidar.p", vector_text(inverse.p)});
  } else {
    const SO3 in_lidar = described.inverse() * fit.R;
    f.text = fmt::format("the LiDAR is turned against its description by {} of the LiDAR", turn_text(in_lidar));
  }
  f.evidence = fmt::format("{:.1f} % of the turning of its sweeps is that of the gyro with this mount, {:.1f} % as described; {}",
                           100 * fit.explained, 100 * lidar_.as_described, detail);
  robot_.lidar.T_imu_lidar.R = fit.R;
  find_rotation(std::move(f), described, fit.R, "lidar.T_imu_lidar.R");
  return fit;
}

void Examination::examine_lidar_clock(const MountFit& fit) {
  if (!fit.fit.good) return;
  const double sigma = fit.offset_sigma();
  constexpr double method = 0.00015;  // s
  refine_offset(Sensor::lidar, fit.offset, sigma, method);
  lidar_offset_ = fit.offset;
  const std::string detail = fmt::format("{:.2f} ms against the IMU, standard deviation {:.2f} ms", 1e3 * fit.offset, 1e3 * sigma);
  if (std::abs(fit.offset) < std::max(lidar_clock_tolerance, sure * sigma)) {
    const bool note = std::abs(fit.offset) > 0.0008 && std::abs(fit.offset) > 3 * sigma;
    check(Sensor::lidar, "clock", note ? Check::Verdict::note : Check::Verdict::good, detail + (note ? ": could be calibrated" : ""));
    return;
  }
  // Times of too small a unit leave the middle of a sweep too early by half of what they leave out.
  const double span = median_duration(), period = recorded_.stamps[static_cast<std::size_t>(Sensor::lidar)].period;
  if (!recorded_.reading.without_deskew && span < 0.7 * period &&
      std::abs(fit.offset - 0.5 * (period - span)) < std::max(0.004, sure * sigma)) {
    find({Sensor::lidar,
          "point_times_unit",
          fmt::format("the points' times span {:.2f} ms of sweeps that take {:.0f} ms", 1e3 * span, 1e3 * period),
          "half of what is missing is what the sweeps turn earlier by: " + detail,
          "the driver must publish the points' times in the unit of their field",
          span / period,
          "",
          {},
          true});
    return;
  }
  // Between a quarter and three quarters of a sweep: clouds that are deskewed already are half a sweep off.
  if (point_times_are_undecided_ && std::abs(std::abs(fit.offset) - 0.5 * span) < 0.25 * span) {
    check(Sensor::lidar, "clock", Check::Verdict::unknown,
          detail + ": so is that of clouds which the driver has deskewed already; more turning would show which it is");
    seems_wrong(Sensor::lidar) = true;
    return;
  }
  find_offset(Sensor::lidar, fit.offset, sigma, "turning of the sweeps against the gyro's");
  robot_.lidar.time_offset += fit.offset;
}

}  // namespace kilvo::lab
