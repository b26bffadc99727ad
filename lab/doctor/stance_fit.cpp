#include "lab/doctor/stance_fit.hpp"

#include <algorithm>
#include <functional>

#include "lab/doctor/stances.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t fewest_stances = 24;  // stances
// What a careful description leaves: of positions, zeros of encoders and lengths.
constexpr double prior_p = 0.01, prior_zero = 0.004, prior_scale = 0.005;  // m, rad, -
constexpr double fixed = 1e-9;                                             // m
constexpr int passes = 3;

}  // namespace

StanceFit fit_stances(RecordedLegs& legs, const Robot& robot, const LegHypothesis* hypothesis, const LidarWay& way, const GyroPath& gyro,
                      double offset, const StanceFreedom& free) {
  StanceFit out;
  Stances stances(legs, robot, hypothesis, way, gyro, offset, true);
  const Eigen::Index n = stances.unknowns();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n), prior = Eigen::VectorXd::Constant(n, prior_zero), step(n);
  prior.head<3>().setConstant(INFINITY);
  prior.segment<3>(Stances::of_p).setConstant(free.size ? INFINITY : prior_p);
  prior[Stances::of_offset] = INFINITY;
  prior[Stances::of_scale] = free.size ? INFINITY : prior_scale;
  prior.segment<3>(Stances::of_apart).setConstant(free.apart ? INFINITY : fixed);
  if (free.joint) prior[Stances::of_zeros + static_cast<Eigen::Index>(*free.joint)] = INFINITY;
  step.setConstant(1e-4);
  step[Stances::of_offset] = Stances::clock_step;
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(n);
  Fit fit;
  for (int k = 0; k < passes; ++k) {
    stances.find(x, k == 0);
    if (stances.stances() < fewest_stances) return out;
    const auto rows = [&stances](const Eigen::VectorXd& at, Residuals& r) { stances.rows(at, r); };
    const auto derivative = [&stances](const Eigen::VectorXd& at, Derivatives& J) { stances.derivative(at, J); };
    fit = robust_fit(rows, none, prior / std::sqrt(stances.repeated()), step, 8, derivative);
    if (!fit.good) return out;
    x = fit.x;
    // Stances clamps the clock there: a larger value is no measurement.
    if (std::abs(x[Stances::of_offset]) > Stances::stance_slack) return out;
  }
  out.good = fit.groups > static_cast<std::size_t>(10 * n);
  out.R_link_imu = stances.rotation(x);
  for (int i = 0; i < 3; ++i) out.rotation_sigma[i] = fit.sigma(i);
  out.offset = offset + x[Stances::of_offset];
  out.offset_sigma = fit.sigma(Stances::of_offset);
  out.scale = 1 + x[Stances::of_scale];
  out.scale_sigma = fit.sigma(Stances::of_scale);
  out.apart = x.segment<3>(Stances::of_apart);
  for (int i = 0; i < 3; ++i) out.apart_sigma[i] = fit.sigma(static_cast<int>(Stances::of_apart) + i);
  for (std::size_t j = 0; j < stances.joints().size(); ++j) {
    const auto i = Stances::of_zeros + static_cast<Eigen::Index>(j);
    out.joints.push_back(legs.recorded().joint_names[stances.joints()[j]]);
    out.zero.push_back(x[i]);
    out.zero_sigma.push_back(fit.sigma(static_cast<int>(i)));
    out.zero_growth.push_back(fit.growth_without_prior[i]);
  }
  out.moved = fit.scale * Stances::unit_p;
  out.stances = stances.stances();
  return out;
}

Eigen::Vector3d sigma_beside(const SO3& first, const Eigen::Vector3d& sigma, const SO3& second, const Eigen::Vector3d& second_sigma) {
  constexpr double usual = 2, elsewhere = 0.35;  // standard deviations; rad: one of them has begun with another mount
  const Eigen::Array3d apart = (first * second.inverse()).Log().array().abs();
  if (apart.maxCoeff() > elsewhere) return sigma;
  const Eigen::Array3d excess = (apart - usual * (sigma.array().square() + second_sigma.array().square()).sqrt()).max(0);
  return (sigma.array().square() + excess.square()).sqrt();
}

Standing standing_time(RecordedLegs& legs, const Robot& robot, const LegHypothesis* hypothesis, const LidarWay& way, const GyroPath& gyro,
                       double offset) {
  return Stances(legs, robot, hypothesis, way, gyro, offset, false).standing();
}

namespace {

// The best `count` of the clocks with the described mount and of the mounts without an offset.
std::vector<LegStart> longest(Stances& stances, const SO3& described, const std::vector<SO3>& mounts, double reach, bool roughly,
                              std::size_t count) {
  std::vector<LegStart> out;
  constexpr double step = 0.02;  // s, which the fit of the stances bridges
  const int steps = static_cast<int>(reach / step);
  for (int k = -steps; k <= steps; ++k) out.push_back({k * step, described, stances.standing(k * step, described, roughly)});
  for (const SO3& mount : mounts) out.push_back({0, mount, stances.standing(0, mount, roughly)});
  std::ranges::stable_sort(out, std::ranges::greater(), [](const LegStart& s) { return s.standing.worth(); });
  // Neighbours lead to the same fit.
  std::vector<LegStart> apart;
  for (const LegStart& start : out) {
    const auto is_near = [&start](const LegStart& s) {
      constexpr double near = 0.25;  // rad
      return std::abs(s.offset - start.offset) < 2.5 * step && (s.R_link_imu.inverse() * start.R_link_imu).Log().norm() < near;
    };
    if (apart.size() < count && std::ranges::none_of(apart, is_near)) apart.push_back(start);
  }
  return apart;
}

}  // namespace

LegStart longest_standing(RecordedLegs& legs, const Robot& robot, const LegHypothesis* hypothesis, const LidarWay& way,
                          const GyroPath& gyro, const std::vector<SO3>& mounts, double reach) {
  Stances stances(legs, robot, hypothesis, way, gyro, 0, false);
  return longest(stances, robot.imu.T_link_imu.R, mounts, reach, false, 1).front();
}

LegStart fitted_standing(RecordedLegs& legs, const Robot& robot, const LegHypothesis* hypothesis, const LidarWay& way, const GyroPath& gyro,
                         const std::vector<SO3>& mounts, double still, double reach) {
  constexpr std::size_t tried = 4;
  Stances stances(legs, robot, hypothesis, way, gyro, 0, false);
  LegStart best;
  for (LegStart start : longest(stances, robot.imu.T_link_imu.R, mounts, reach, true, tried)) {
    Robot turned = robot;
    turned.imu.T_link_imu.R = start.R_link_imu;
    const StanceFit fit = fit_stances(legs, turned, hypothesis, way, gyro, start.offset);
    if (!fit.good || fit.moved >= still) continue;
    start = {fit.offset, fit.R_link_imu, stances.standing(fit.offset, fit.R_link_imu)};
    if (start.standing.worth() > best.standing.worth()) best = start;
  }
  return best;
}

}  // namespace kilvo::lab
