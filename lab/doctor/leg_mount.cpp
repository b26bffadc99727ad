// The IMU on the link that the legs carry, and the legs' clock: by their turning, and by the feet that stand.
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/core.h>
#include <functional>

#include "lab/doctor/examination.hpp"
#include "lab/doctor/sole_level.hpp"

namespace kilvo::lab {
namespace {

constexpr double leg_rotation_tolerance = 2.5;  // degrees
constexpr double well_explained = 0.9;          // of the legs' acceleration
// s, with and without a LiDAR: without one, soles that roll shift it by 6 ms, soft ones by more.
constexpr double leg_clock_tolerance = 0.0045, alone_leg_clock_tolerance = 0.025;

// What another evidence than the turning says.
void adopt(const SO3& R, const Eigen::Vector3d& R_sigma, double offset, double offset_sigma, MountFit& fit) {
  if (!fit.fit.good) fit.fit.cov = Eigen::MatrixXd::Zero(7, 7);
  fit.fit.good = true;
  fit.R = R;
  fit.offset = offset;
  fit.fit.cov.diagonal().head<4>() << R_sigma.cwiseAbs2(), offset_sigma * offset_sigma;
}

}  // namespace

// A link that turns as this one does, and as it lies: only the place of the IMU would differ, which the turning does not show.
bool Examination::turns_with_link(const LegHypothesis& other) const {
  constexpr double rarely = 1;  // s
  const std::vector<LegPose> here = legs_under(nullptr, rarely), there = legs_under(&other, rarely);
  if (here.empty() || here.size() != there.size()) return false;
  constexpr double alike = 0.17;  // rad
  return std::ranges::all_of(std::array{std::size_t{0}, here.size() / 2, here.size() - 1},
                             [&](std::size_t i) { return (there[i].foot[0].R_IF * here[i].foot[0].R_IF.inverse()).Log().norm() < alike; });
}

// By the turning alone: each interval by the foot that turns as the gyro does. The foot that swings turns as well: no mount that puts the
// robot on its head.
MountFit Examination::measure_leg_mount() const {
  const SO3 described = robot_.imu.T_link_imu.R.inverse();
  const GyroPath path = gyro();
  const auto fit_from = [&](const SO3& start) {
    MountFit fit = fit_mount(leg_turns_, path, start, leg_start_ ? leg_offset_ : legs_.offset);
    const double explained = fit.explained;
    for (int k = 0; k < 2 && fit.fit.good; ++k) fit = fit_mount(best_half(leg_turns_, path, fit), path, fit.R, fit.offset);
    fit.explained = explained;
    fit.fit.good = fit.fit.good && tilt_under(fit.R.inverse(), false).value_or(0) < most_tilt;
    return fit;
  };
  if (legs_.agrees) return fit_from(described);
  const MountFit fit = fit_from(SO3::nearest(legs_.error * described.matrix()));
  return fit.fit.good ? fit : fit_from(described);
}

// The turning tells the mount to some degrees, whatever the lengths; the acceleration to half of one, if they are right.
bool Examination::accelerates_as_it_turns(const MountFit& by_turning, const SO3& R_link_imu) const {
  const SO3 by_acceleration = R_link_imu.inverse() * SO3::Exp(leg_acceleration_.turn), described = robot_.imu.T_link_imu.R.inverse();
  const double angle = (by_acceleration * described.inverse()).Log().norm();
  if (degrees(angle) < leg_rotation_tolerance) return true;
  return by_turning.fit.good && (by_acceleration * by_turning.R.inverse()).Log().norm() < 0.5 * angle;
}

bool Examination::examine_leg_shape() {
  const double angle = leg_acceleration_.turn.norm();
  // Soles that creep by a centimetre in a stance turn it by 4 to 6 degrees.
  constexpr double creeping = 0.035;  // rad
  if (const double sigma = std::hypot(creeping, leg_acceleration_.sigma.norm()); angle < sure * sigma) {
    check(Sensor::legs, "mount of the IMU, lengths", Check::Verdict::unknown,
          fmt::format("by their acceleration the legs are turned by {:.1f} degrees, standard deviation {:.1f}, and not by their turning",
                      degrees(angle), degrees(sigma)));
    return false;
  }
  Finding f{Sensor::legs, "leg_lengths", {}, {}, {}, std::sin(angle), {}, {}, true};
  f.text =
      fmt::format("the lengths of thigh and shin do not fit each other: by them the robot accelerates in a direction {:.1f} degrees off",
                  degrees(angle));
  f.evidence = fmt::format("the legs turn as the gyro does with the described mount; {:.0f} % of their acceleration is explained",
                           100 * leg_acceleration_.explained);
  f.remedy = "robot.urdf: the lengths of thigh and shin, or the URDF of this robot";
  find(std::move(f));
  return true;
}

// Sets the mount of `start` to the one that the fit began with: the described one, or that of the turning.
StanceFit Examination::standing_by(Robot& start, const MountFit& by_turning, double method) const {
  const bool turned = legs_turned() && by_turning.fit.good;
  const double far = turned ? degrees((by_turning.R * robot_.imu.T_link_imu.R).Log().norm()) : 0;
  constexpr double near = 15;  // degrees
  if (leg_start_) {
    start.imu.T_link_imu.R = *leg_start_;
  } else if (far > near) {
    start.imu.T_link_imu.R = by_turning.R.inverse();
  }
  if (lidar_way().empty()) return {};
  const auto fit = [&](const Robot& robot) {
    return fit_stances(recorded_legs_, robot, leg_mend_ ? &*leg_mend_ : nullptr, lidar_way(), gyro(),
                       turned && !leg_start_ ? by_turning.offset : leg_offset_);
  };
  StanceFit stances = fit(start);
  if (stances.good || leg_start_ || far > near || far <= std::max(leg_rotation_tolerance, sure * method)) return stances;
  // By a mount that is some degrees off the feet may not stand.
  Robot turned_by = start;
  turned_by.imu.T_link_imu.R = by_turning.R.inverse();
  const StanceFit by_turned = fit(turned_by);
  if (!by_turned.good) return stances;
  start = turned_by;
  return by_turned;
}

std::pair<double, double> Examination::vertical_bias(const MountFit& fit) const {
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), rate = Eigen::Vector3d::Zero();
  for (const InertialSample& s : recorded_.imu) force += s.accel, rate += s.gyro / static_cast<double>(recorded_.imu.size());
  const Eigen::Vector3d up = (accel_axes_ * force).normalized();
  // Soles that turn on the ground: between windows of 30 s of six sound walks of levels 1 and 2 it differs by 0.003 at the most.
  // In a turn they turn always the same way, by a share of it.
  constexpr double of_soles = 0.003, of_turn = 0.05;  // rad/s, -
  const Eigen::Vector3d sigma(fit.fit.sigma(4), fit.fit.sigma(5), fit.fit.sigma(6));
  return {up.dot(fit.bias), std::hypot(of_soles, of_turn * up.dot(rate), up.cwiseProduct(sigma).norm())};
}

// The turning knows the mount to some degrees, the soles its inclination: both together.
bool Examination::find_inclined_imu(const MountFit& fit, double method) {
  const SO3 described = robot_.imu.T_link_imu.R.inverse();
  const auto soles = sole_level(legs_under(nullptr), mended_imu(), gyro(), robot_.imu.T_link_imu.R, fit.offset,
                                [this](double t) { return stepping_.bears(t); });
  if (!soles || !fit.fit.good) return false;
  const Eigen::Matrix3d to_imu = described.matrix();
  const Eigen::Vector3d by_turning = (fit.R * described.inverse()).Log(), by_soles = -(to_imu * soles->turn);
  const Eigen::Matrix3d of_soles = to_imu * soles->information * to_imu.transpose();
  const double sigma_method = method / degrees(1);
  const Eigen::Matrix3d of_turning = (fit.rotation_sigma().array().square() + sigma_method * sigma_method).inverse().matrix().asDiagonal();
  const Eigen::Matrix3d information = of_turning + of_soles;
  const Eigen::Vector3d turn = information.ldlt().solve(of_turning * by_turning + of_soles * by_soles);
  const auto off = [](const Eigen::Vector3d& x, const Eigen::Matrix3d& A) { return std::sqrt(x.dot(A * x)); };
  constexpr double inclined = 4, agree = 3;  // degrees; standard deviations
  // The soles show at least half of it: they say nothing of what is about the vertical.
  if (by_soles.dot(turn) < 0.5 * turn.squaredNorm()) return false;
  if (degrees(turn.norm()) < inclined || off(turn, information) < sure_among(3)) return false;
  if (off(by_turning - turn, of_turning) > agree || off(by_soles - turn, of_soles) > agree) return false;
  settle_imu_link((SO3::Exp(turn) * described).inverse());
  if (!diagnosis_.findings.empty() && diagnosis_.findings.back().cause == "imu_mount_rotation") {
    Finding& f = diagnosis_.findings.back();
    f.turn = turn;
    f.evidence = fmt::format(
        "the soles are inclined by {:.1f} degrees on the mean, whichever way the robot goes, and by the turning of the legs against the "
        "gyro's it is turned by {:.1f}; together {:.1f} standard deviations",
        degrees(soles->turn.norm()), degrees(by_turning.norm()), off(turn, information));
  }
  return true;
}

void Examination::examine_leg_rotation() {
  const SO3 described = robot_.imu.T_link_imu.R.inverse();
  MountFit fit = measure_leg_mount();
  if (fit.fit.good && legs_turned() && lidar_way().empty()) diagnosis_.gyro_bias = vertical_bias(fit);
  // What soles that roll and links that bend shift both by shows in what is not explained.
  const double unexplained = std::max(0.0, 1 - fit.explained);
  double method = 0.2 + 10 * unexplained, clock_method = 0.001 + 0.04 * unexplained;  // degrees, s
  const LidarWay& way = lidar_way();
  Robot start = robot_;
  const StanceFit stances = standing_by(start, fit, method);
  if (!legs_turned() && !stances.good) {
    check(Sensor::legs, "mount of the IMU, clock", Check::Verdict::unknown, "the robot hardly turned: walk and turn");
    return;
  }
  if (stances.good && legs_turned() && find_wrong_zero(stances, start)) {
    leg_turns_ = leg_turns(legs_under(nullptr), turn_interval);
    examine_leg_rotation();
    return;
  }
  if (!stances.good) leg_acceleration_ = leg_acceleration(nullptr, start.imu.T_link_imu.R, fit.fit.good ? fit.offset : leg_offset_);
  const bool accelerates = leg_acceleration_.explained > well_explained;
  if (!fit.fit.good && !stances.good && !accelerates) {
    check(Sensor::legs, "mount of the IMU", Check::Verdict::unknown, "too few steps");
    return;
  }
  if (stances.good) {
    const SO3 by_stances = stances.R_link_imu.inverse();
    const Eigen::Vector3d of_turning = (fit.rotation_sigma().array().square() + std::pow(method / degrees(1), 2)).sqrt();
    const Eigen::Vector3d sigma =
        fit.fit.good ? sigma_beside(by_stances, stances.rotation_sigma, fit.R, of_turning) : stances.rotation_sigma;
    adopt(by_stances, sigma, stances.offset, stances.offset_sigma, fit);
    constexpr double stance_method = 0.2, if_hardly_turned = 0.5, stance_clock_method = 0.0004;  // degrees, degrees, s
    method = legs_turned() ? stance_method : if_hardly_turned;
    clock_method = stance_clock_method;
  } else if (accelerates && !accelerates_as_it_turns(fit, start.imu.T_link_imu.R)) {
    // Their turning shows a clock that is far off all the same.
    if (!examine_leg_shape() && fit.fit.good) examine_leg_clock(fit, clock_method, alone_leg_clock_tolerance);
    return;
  } else if (accelerates) {
    adopt(start.imu.T_link_imu.R.inverse() * SO3::Exp(leg_acceleration_.turn), leg_acceleration_.sigma, leg_acceleration_.offset,
          leg_acceleration_.offset_sigma, fit);
    method = degrees(leg_acceleration_.mount_method());
    clock_method = 0.001 + 0.04 * (1 - leg_acceleration_.explained);
  }
  leg_offset_ = fit.offset;
  refine_rotation(Sensor::imu, "rotation of the IMU on the robot", described, fit.R, fit.rotation_sigma(), method, "imu.T_link_imu.R");
  Refinement& mount = refinements_.back();
  mount.changes = {{"imu.T_link_imu.R", rotation_text(turned_by(described, mount).inverse())}};
  for (auto* x : {&mount.change, &mount.taken}) std::ranges::transform(*x, x->begin(), std::negate());  // of the mount, not of its inverse
  if (!recorded_.reading.leg_clock_is_found) refine_offset(Sensor::legs, fit.offset, fit.offset_sigma(), clock_method);
  if (stances.good) {
    refine_zeros(stances);
    if (legs_turned()) examine_feet_apart(start);
  }
  const Eigen::Vector3d turn = (fit.R * described.inverse()).Log();
  const double angle = degrees(turn.norm()), uncertain = std::hypot(degrees(fit.rotation_sigma().norm()), method);
  const std::string detail = fmt::format("{:.1f} degrees from the description, standard deviation {:.1f}; {:.0f} % explained", angle,
                                         uncertain, 100 * fit.explained);
  constexpr double alone_tolerance = 12;  // degrees: legs and gyro alone
  if (!stances.good && !accelerates && way.empty() && find_inclined_imu(fit, method)) {
    // found
  } else if (angle > std::max(stances.good || accelerates ? leg_rotation_tolerance : alone_tolerance, sure * uncertain)) {
    settle_imu_link(fit.R.inverse());
    if (!diagnosis_.findings.empty() && diagnosis_.findings.back().cause == "imu_mount_rotation") {
      diagnosis_.findings.back().turn = turn;
      diagnosis_.findings.back().evidence = "turning of the legs against the gyro's: " + detail;
    }
  } else {
    constexpr double vague = 3, likely = 2;  // degrees; standard deviations
    const bool is_likely = angle > std::max(leg_rotation_tolerance, likely * uncertain);
    seems_wrong(Sensor::imu) |= is_likely || (stances.good || accelerates ? angle > leg_rotation_tolerance : !way.empty());
    const bool is_open = uncertain > vague || is_likely;
    check(Sensor::imu, "rotation of its mount on the robot", is_open ? Check::Verdict::unknown : Check::Verdict::good, detail);
  }
  if (stances.good || accelerates) fit.explained = 1;  // the feet stand
  examine_leg_clock(fit, clock_method, stances.good ? leg_clock_tolerance : alone_leg_clock_tolerance);
}

void Examination::examine_leg_clock(const MountFit& fit, double method, double tolerance) {
  const double sigma = std::hypot(fit.offset_sigma(), method);
  const std::string clock = fmt::format("{:.1f} ms against the IMU, standard deviation {:.1f} ms", 1e3 * fit.offset, 1e3 * sigma);
  if (recorded_.reading.leg_clock_is_found) {
    check(Sensor::legs, "clock", Check::Verdict::note, clock + "; found by the program (legs.clock)");
  } else if (std::abs(fit.offset) < std::max(tolerance, sure * sigma) || fit.explained < 0.6) {
    check(Sensor::legs, "clock", fit.explained < 0.6 ? Check::Verdict::unknown : Check::Verdict::good, clock);
    leg_offset_ = 0;
  } else {
    // What the acceleration has found is known better now.
    std::erase_if(diagnosis_.findings, [](const Finding& f) { return f.cause == "legs_clock"; });
    find_offset(Sensor::legs, fit.offset, sigma, "the legs against the gyro");
  }
}

}  // namespace kilvo::lab
