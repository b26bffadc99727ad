// The LiDAR: the times of its points, the rotation and the position of its mount, its clock.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <span>

#include "lab/doctor/examination.hpp"

namespace kilvo::lab {
namespace {

// A careful mount reaches a tenth of this.
constexpr double lidar_rotation_tolerance = 0.7;  // degrees
constexpr double worth_a_note = 0.08;             // degrees
constexpr double lidar_clock_tolerance = 0.0035;  // s
constexpr double believable = 0.2;                // m/s, that the acceleration and the way may be apart by

double mean_thickness(std::span<const SweepPose> way) {
  double sum = 0, n = 0;
  for (const SweepPose& p : way) {
    if (!p.good || p.thickness == 0) continue;
    sum += p.thickness;
    n += 1;
  }
  return n > 0 ? sum / n : INFINITY;
}

std::vector<Turn> turns_of(const std::vector<SweepPose>& way) {
  std::vector<Turn> out;
  for (std::size_t i = 1; i < way.size(); ++i) {
    const SweepPose &a = way[i - 1], &b = way[i];
    if (a.good && b.good && b.t - a.t < 0.6 && b.t > a.t)
      out.push_back({a.t, b.t, {(a.T_WL.R.inverse() * b.T_WL.R).Log(), Eigen::Vector3d::Zero()}, 1});
  }
  return out;
}

// The same way as seen by a LiDAR whose points are mirrored.
std::vector<SweepPose> mirrored(std::vector<SweepPose> way, const Eigen::Matrix3d& M) {
  for (SweepPose& pose : way) {
    pose.T_WL = {SO3::nearest(M * pose.T_WL.R.matrix() * M), M * pose.T_WL.p};
    pose.v_W = M * pose.v_W;
  }
  return way;
}

}  // namespace

// Deskewed by the gyro as described, if they turn as it does then; else as rigid ones, so that neither mount nor clock can spoil it.
void Examination::register_sweeps() {
  if (recorded_.sweeps.empty()) return;
  const SO3 described = robot_.lidar.T_imu_lidar.R;
  constexpr double least_explained = 0.8;
  if (earlier_.origin != recorded_.origin) earlier_ = {earlier_.point_times_are_good, recorded_.origin, {}, {}};
  const GyroPath path = gyro();
  earlier_.described.extend(recorded_.sweeps, {&path, described});
  first_ = earlier_.described.way();
  lidar_turns_ = turns_of(first_);
  lidar_ = agreement(lidar_turns_, described, least_explained);
  deskewed_ = lidar_.known && lidar_.agrees;
  const bool turned = lidar_.explained != 0;
  if (deskewed_ || !turned) return;
  first_ = scan_odometry(recorded_.sweeps, {});
  lidar_turns_ = turns_of(first_);
  lidar_ = agreement(lidar_turns_, described, least_explained);
}

void Examination::examine_lidar() {
  const std::size_t clouds = recorded_.stamps[static_cast<std::size_t>(Sensor::lidar)].count;
  if (clouds >= 30 && recorded_.sweeps.size() < clouds / 10) {
    find({Sensor::lidar,
          "lidar_unit",
          "hardly a point of the clouds is between 0.5 and 200 m: they are not in metres",
          fmt::format("{} of {} clouds have such points", recorded_.sweeps.size(), clouds),
          "the driver must publish metres",
          0,
          "",
          {},
          true});
    return;
  }
  if (recorded_.sweeps.size() < 30) return;
  if (!lidar_.known) {
    check(Sensor::lidar, "mount and clock", Check::Verdict::unknown,
          fmt::format("its sweeps do not turn as the gyro does under any mount ({:.0f} % explained), or hardly turn: walk and turn",
                      100 * lidar_.explained));
    return;
  }
  const std::size_t before = diagnosis_.findings.size();
  examine_point_times();
  const MountFit fit = examine_lidar_rotation();
  // Without times a sweep is taken at its stamp: that half a sweep is missing is no fault of the clock.
  if (diagnosis_.findings.size() > before && diagnosis_.findings[before].cause == "point_times_absent") return;
  if (way_.empty()) return;
  examine_lidar_clock(fit);
  examine_lidar_position();
}

// Deskewed with the right times the surroundings are sharpest.
void Examination::examine_point_times() {
  double span = 0;
  for (const Sweep& s : recorded_.sweeps) span = std::max(span, s.end - s.begin);
  if (span < 1e-4) {
    find({Sensor::lidar,
          "point_times_absent",
          "all points of a sweep have the same time",
          fmt::format("the longest sweep lasts {:.3f} ms by its points", 1e3 * span),
          "the driver must publish point times (or kilvo run --no-deskew for a LiDAR that measures at once)",
          span,
          "s",
          {},
          true});
    return;
  }
  const GyroPath path = gyro();
  Deskew deskew{&path, robot_.lidar.T_imu_lidar.R};
  deskew_first(deskew);
  if (!earlier_.point_times_are_good && point_times_run_backwards(deskew)) {
    deskew.reversed = true;
    way_ = scan_odometry(recorded_.sweeps, deskew);
  }
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

// With the times as they come, or reversed, or without: which leaves the thinnest surfaces.
bool Examination::point_times_run_backwards(Deskew deskew) {
  // The stretch that turns most.
  std::size_t best = 0;
  double most = -1;
  constexpr std::size_t stretch = 70;
  std::vector<double> sums(recorded_.sweeps.size() + 1, 0);
  for (std::size_t i = 0; i < recorded_.sweeps.size(); ++i) {
    const Sweep& s = recorded_.sweeps[i];
    sums[i + 1] = sums[i] + (deskew.gyro->covers(s.begin, s.end) && s.end > s.begin ? deskew.gyro->rate(s.begin, s.end).norm() : 0);
  }
  for (std::size_t i = 0; i + stretch < sums.size(); ++i) {
    if (sums[i + stretch] - sums[i] <= most) continue;
    most = sums[i + stretch] - sums[i];
    best = i;
  }
  constexpr double clearly = 0.9;
  const OdometryRange range{best, best + stretch};
  const double rigid = mean_thickness(scan_odometry(recorded_.sweeps, {}, range));
  // Times that help would not help the other way round.
  if (const double with = mean_thickness(std::span(way_).subspan(best, std::min(stretch, way_.size() - best))); with < clearly * rigid) {
    earlier_.point_times_are_good = true;
    check(Sensor::lidar, "point times", Check::Verdict::good,
          fmt::format("surfaces are {:.1f} mm thick with the points' times, {:.1f} mm without", 1e3 * with, 1e3 * rigid));
    return false;
  }
  const double forward = mean_thickness(scan_odometry(recorded_.sweeps, deskew, range));
  deskew.reversed = true;
  const double backward = mean_thickness(scan_odometry(recorded_.sweeps, deskew, range));
  const std::string evidence =
      fmt::format("surfaces are {:.1f} mm thick with the points' times, {:.1f} mm with reversed ones, {:.1f} mm without", 1e3 * forward,
                  1e3 * backward, 1e3 * rigid);
  if (backward < clearly * forward && backward < rigid) {
    find({Sensor::lidar,
          "point_times_reversed",
          "the points' times run backwards within a sweep",
          evidence,
          "the driver must publish the time of each point from the beginning of the sweep",
          0,
          "",
          {},
          true});
    return true;
  }
  earlier_.point_times_are_good = forward <= rigid / clearly;
  check(Sensor::lidar, "point times", earlier_.point_times_are_good ? Check::Verdict::good : Check::Verdict::note, evidence);
  return false;
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
  const bool inverted = degrees((inverse.R * described.inverse()).Log().norm()) > 0.7 * angle &&
                        degrees((fit.R * inverse.R.inverse()).Log().norm()) < std::min(0.3 * angle, std::max(0.15 * angle, 3 * uncertain));
  if (inverted) {
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
  std::vector<double> spans;
  for (const Sweep& s : recorded_.sweeps) spans.push_back(s.end - s.begin);
  std::ranges::nth_element(spans, spans.begin() + static_cast<std::ptrdiff_t>(spans.size() / 2));
  const double span = spans[spans.size() / 2], period = recorded_.stamps[static_cast<std::size_t>(Sensor::lidar)].period;
  if (span < 0.7 * period && std::abs(fit.offset - 0.5 * (period - span)) < std::max(0.004, sure * sigma)) {
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
  find_offset(Sensor::lidar, fit.offset, sigma, "turning of the sweeps against the gyro's");
  robot_.lidar.time_offset += fit.offset;
}

}  // namespace kilvo::lab
