// Where the LiDAR sits on the IMU, by its way and the acceleration.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <optional>
#include <utility>
#include <vector>

#include "lab/doctor/examination.hpp"

namespace kilvo::lab {
namespace {

constexpr double position_tolerance = 0.02, worth_waiting = 0.05;  // m
constexpr double largest_position_sigma = 0.01;                    // m
// Standard deviations: that are of the scatter alone, and a right place was 4 of them off on 14 s of soft ground, 6 on a walk to and fro
// with a rough IMU.
constexpr double sure_of_position = 8;

}  // namespace

Refinement refined_lidar_position(const Eigen::Vector3d& described, const Eigen::Vector3d& error, const Eigen::Vector3d& sigma,
                                  double method) {
  Refinement r = refinement(Sensor::lidar, lidar_position, {error.x(), error.y(), error.z()}, {sigma.x(), sigma.y(), sigma.z()}, method,
                            largest_position_sigma, fmt::format("m"));
  r.changes = {{"lidar.T_imu_lidar.p", vector_text(described + r.taken_vector())}};
  return r;
}

Refinement refined_lidar_position(const Eigen::Vector3d& described, MountMeasurement measured, const Eigen::Vector3d& turned) {
  constexpr double method = 0.001;  // m
  const Eigen::Vector3d error = measured.error.tail<3>(), sigma = measured.covariance.diagonal().tail<3>().cwiseSqrt();
  Refinement r = refined_lidar_position(described, error, sigma, method);
  measured.covariance.diagonal().tail<3>().array() += method * method;
  const auto shift = expected_shift(measured, turned);
  for (std::size_t i = 0; i < 3; ++i) {
    const bool is_taken = shift && r.sigma[i] <= largest_position_sigma;
    r.taken[i] = is_taken ? (*shift)[static_cast<Eigen::Index>(i)] : 0;
  }
  r.changes = {{"lidar.T_imu_lidar.p", vector_text(described + r.taken_vector())}};
  return r;
}

void Examination::examine_lidar_position() {
  if (std::ranges::any_of(diagnosis_.findings, [](const Finding& f) { return f.cause == "accel_gravity"; })) {
    check(Sensor::lidar, "position of the mount", Check::Verdict::unknown, "the acceleration is not what was measured");
    return;
  }
  const SO3 R_IL = SO3::nearest(lidar_.error * original_.lidar.T_imu_lidar.R.matrix());
  const TranslationRows rows(way_, recorded_.imu, gyro(), R_IL, lidar_offset_);
  translation_ = rows.refine(accel_axes_);
  if (!translation_) {
    check(Sensor::lidar, "position of the mount", Check::Verdict::unknown, "too few sweeps in a row that know their way");
    return;
  }
  lidar_scale_ = rows.scale(accel_axes_, *translation_);
  if (lidar_scale_contradicts() && !settle_lidar_scale_by_slow_motion(R_IL)) return;
  if (examine_lidar_scale()) return;
  const TranslationFit& fit = *translation_;
  const Eigen::Vector3d described = robot_.lidar.T_imu_lidar.p, error = fit.r - described;
  const Eigen::Vector3d sigma(fit.sigma_r(0), fit.sigma_r(1), fit.sigma_r(2));
  constexpr double method = 0.002;  // m: with it, 20 walks are off by what is predicted
  refinements_.push_back(refined_lidar_position(described, error, sigma, method));
  bool wrong = false;
  for (int i = 0; i < 3; ++i) wrong |= std::abs(error[i]) > std::max(position_tolerance, sure_of_position * sigma[i]);
  const std::string detail =
      fmt::format("measured ({:.3f}, {:.3f}, {:.3f}) m, standard deviations ({:.3f}, {:.3f}, {:.3f}), described ({:.3f}, {:.3f}, {:.3f})",
                  fit.r.x(), fit.r.y(), fit.r.z(), sigma.x(), sigma.y(), sigma.z(), described.x(), described.y(), described.z());
  if (!wrong) {
    seems_wrong(Sensor::lidar) |= error.cwiseAbs().maxCoeff() > worth_waiting;
    check(Sensor::lidar, "position of the mount", sigma.maxCoeff() > 0.05 ? Check::Verdict::unknown : Check::Verdict::good, detail);
    return;
  }
  Finding f{Sensor::lidar, "lidar_position", "", detail, "", error.norm(), "m", {}, true};
  const Eigen::Vector3d inverse = -(R_IL.inverse() * described);
  const double tolerance = std::max(0.02, 3 * sigma.norm());
  Eigen::Vector3d right = described;
  for (int i = 0; i < 3; ++i) {
    if (std::abs(error[i]) > std::max(3 * sigma[i], 0.6 * position_tolerance)) right[i] = std::round(1e3 * fit.r[i]) / 1e3;
  }
  if (described.norm() > 3) {
    f.cause = "lidar_unit";
    const bool centimetres = (fit.r - 1e-2 * described).norm() < (fit.r - 1e-3 * described).norm();
    f.text = fmt::format("the LiDAR's position of {:.0f} m on the IMU is in {}metres", described.norm(), centimetres ? "centi" : "milli");
    right = (centimetres ? 1e-2 : 1e-3) * described;
  } else if ((fit.r - inverse).norm() < tolerance && (fit.r - inverse).norm() < 0.5 * error.norm()) {
    f.cause = "lidar_inverted";
    f.text = "the LiDAR's mount is given the wrong way round (the IMU in the LiDAR's frame)";
    right = inverse;
  } else {
    const Eigen::Vector3d off = right - described;  // of what is known well
    f.text = fmt::format("the LiDAR is {:.0f} cm from where it is described, ({:.2f}, {:.2f}, {:.2f}) m off", 100 * off.norm(), off.x(),
                         off.y(), off.z());
  }
  f.size = (right - described).norm();
  f.remedy = fmt::format("lidar.T_imu_lidar.p: {}", vector_text(right));
  f.changes = {{"lidar.T_imu_lidar.p", vector_text(right)}};
  robot_.lidar.T_imu_lidar.p = right;
  find(std::move(f));
}

bool Examination::lidar_scale_contradicts() const {
  constexpr double tolerance = 0.1;
  const WayScale& s = lidar_scale_;
  return s.distance_to(1) >= sure && (s.factor >= 1 + tolerance || s.most <= 1 - tolerance);
}

// Points of another unit are as wrong for slow motion as for fast one, and it knows their scale better. An accelerometer that aliases or is
// filtered explains neither, and is no witness: then false, and the scale is unknown. Sampling errors go with the square of the period, so
// that those of half of the samples are four times as large (L. F. Richardson, 1911).
bool Examination::settle_lidar_scale_by_slow_motion(const SO3& R_IL) {
  constexpr double apart = 0.25,
                   known = 0.06;  // s, -: true scales of 0.3 to 1.5 were known to 0.05, those of an aliasing IMU to 0.07 to 0.2
  std::vector<SweepPose> slow;
  for (const SweepPose& pose : way_)
    if (slow.empty() || pose.t - slow.back().t > apart) slow.push_back(pose);
  std::vector<InertialSample> half;
  for (std::size_t i = 0; i < recorded_.imu.size(); i += 2) half.push_back(recorded_.imu[i]);
  if (half.back().t < recorded_.imu.back().t) half.push_back(recorded_.imu.back());
  const auto scale_with = [&](const std::vector<SweepPose>& way, const std::vector<InertialSample>& imu) -> std::optional<WayScale> {
    const TranslationRows rows(way, imu, gyro(), R_IL, lidar_offset_);
    const auto fit = rows.fit(accel_axes_);
    return fit ? std::optional(rows.scale(accel_axes_, *fit)) : std::nullopt;
  };
  const double fast = lidar_scale_.factor;
  const auto of_slow = scale_with(slow, recorded_.imu);
  if (of_slow) lidar_scale_ = *of_slow;
  if (const auto coarse = scale_with(of_slow ? slow : way_, half))
    lidar_scale_.sigma = std::hypot(lidar_scale_.sigma, (coarse->factor - lidar_scale_.factor) / 3);
  // A short way shows no slow motion: of a small factor the error itself counts.
  if (lidar_scale_.sigma < known * (of_slow ? lidar_scale_.factor : std::max(1.0, lidar_scale_.factor))) return true;
  check(Sensor::lidar, "position of the mount", Check::Verdict::unknown,
        fmt::format("way of the sweeps through that of the accelerometer: {:.2f}, {} {:.2f}, standard deviation {:.2f}: "
                    "the accelerometer aliases, is filtered, or its stamps are wrong",
                    fast, of_slow ? "of three sweeps together" : "of the same sweeps", lidar_scale_.factor, lidar_scale_.sigma));
  translation_.reset();
  lidar_scale_ = {};
  return false;
}

// By the acceleration alone: points of another unit. What is off by less shows against the legs as well.
bool Examination::examine_lidar_scale() {
  const WayScale& s = lidar_scale_;
  if (!lidar_scale_contradicts()) return false;
  accuse_lidar_scale(
      s.factor, fmt::format("way of the sweeps through that of the accelerometer: {:.3f}, standard deviation {:.3f}", s.factor, s.sigma));
  translation_.reset();
  way_.clear();
  return true;
}

void Examination::accuse_lidar_scale(double factor, const std::string& evidence) {
  find({Sensor::lidar,
        "lidar_unit",
        fmt::format("the LiDAR's points are {:.3f} times as far as they should be", factor),
        evidence,
        "the driver must publish metres: the scale of its ranges is wrong",
        factor,
        "",
        {},
        true});
}

// Legs that are too short and points that are too far look alike: the acceleration agrees with one of them. A URDF is wrong more often.
bool Examination::accuse_lidar_instead(double scale, const std::string& evidence) {
  constexpr double clearly = 2;  // standard deviations
  const double if_lidar = lidar_scale_.distance_to(scale), if_legs = lidar_scale_.distance_to(1);
  if (!(if_legs * if_legs - if_lidar * if_lidar > clearly * clearly)) return false;
  accuse_lidar_scale(scale, fmt::format("{}; way of the sweeps through that of the accelerometer {:.3f}, standard deviation {:.3f}",
                                        evidence, lidar_scale_.factor, lidar_scale_.sigma));
  return true;
}

}  // namespace kilvo::lab
