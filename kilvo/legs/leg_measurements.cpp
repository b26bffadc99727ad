#include "kilvo/legs/leg_measurements.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace kilvo {
namespace {

// The corners of a rolling sole that are this much faster than the slowest one carry e^-0.5 of its weight, m/s.
constexpr double rolling_speed = 0.02;
// alpha_s of Eq. 8, of the standard deviation.
constexpr double loosest = 10;
// A foot enters loosely and settles over this time, s.
constexpr double entry_time = 0.02;
constexpr double shortest_step = 1e-4, longest_step = 0.05;  // s

}  // namespace

FootVelocityRow foot_velocity(const State& x, const SolePoint& point, const Eigen::Vector3d& gyro) {
  const Eigen::Matrix3d& R = x.R.matrix();
  const Eigen::Vector3d s = (gyro - x.bg).cross(point.p) + point.v;
  return {x.v + R * s, -R * skew(s), Eigen::Matrix3d::Identity(), R * skew(point.p)};
}

FootPositionRow foot_position(const State& x, const SolePoint& point, const Eigen::Vector3d& pc) {
  const Eigen::Matrix3d& R = x.R.matrix();
  return {x.p + R * point.p - pc, -R * skew(point.p), Eigen::Matrix3d::Identity(), -Eigen::Matrix3d::Identity()};
}

Rows<12> LegModel::operator()(const State& x, const Covariance& prior) {
  Rows<12> rows;
  rows.r.resize(12);
  rows.H.setZero(12, at::size);
  rows.R.setZero(12, 12);
  // A density: rows within one correlation time say it once together.
  const double velocity = config_.velocity_sigma * config_.velocity_sigma * std::max(1.0, config_.velocity_correlation / step_.dt);
  const double position = config_.position_sigma * config_.position_sigma * std::max(1.0, config_.position_correlation / step_.dt);
  int count = 0;
  for (std::size_t side = 0; side < 2; ++side) {
    passed_[side] = false;
    const Stance& foot = step_.foot[side];
    if (!foot.used) continue;
    const int pc = at::pcl + 3 * static_cast<int>(side);
    const FootVelocityRow v = foot_velocity(x, foot.point, gyro_);
    const FootPositionRow p = foot_position(x, foot.point, x.pc[side]);
    auto Hv = rows.H.middleRows<3>(count);
    auto Hp = rows.H.middleRows<3>(count + 3);
    Hv.middleCols<3>(at::R) = v.J_R;
    Hv.middleCols<3>(at::v) = v.J_v;
    Hv.middleCols<3>(at::bg) = v.J_bg;
    Hp.middleCols<3>(at::R) = p.J_R;
    Hp.middleCols<3>(at::p) = p.J_p;
    Hp.middleCols<3>(pc) = p.J_pc;
    rows.r.segment<3>(count) = v.r;
    rows.r.segment<3>(count + 3) = p.r;
    rows.R.diagonal().segment<3>(count).setConstant(foot.looseness * velocity);
    rows.R.diagonal().segment<3>(count + 3).setConstant(foot.looseness * position);
    // The gate looks at the velocity as it is, not as a density: is this foot moving?
    Eigen::Vector3d spread = prior.diagonal().segment<3>(at::v);
    spread.array() += foot.looseness * config_.velocity_sigma * config_.velocity_sigma;
    const double gate2 = config_.gate * config_.gate;
    if ((v.r.array().square() > gate2 * spread.array() * loosest).any()) {
      Hv.setZero();
      Hp.setZero();
      rows.R.diagonal().segment<6>(count).setZero();
      continue;
    }
    passed_[side] = true;
    count += 6;
  }
  rows.r.conservativeResize(count);
  rows.H.conservativeResize(count, at::size);
  rows.R.conservativeResize(count, count);
  return rows;
}

void begin_stance(Estimate& e, std::size_t side, const SolePoint& point, const LegConfig& config) {
  const int pc = at::pcl + 3 * static_cast<int>(side);
  const Eigen::Matrix3d J_R = -e.x.R.matrix() * skew(point.p);
  e.x.pc[side] = e.x.pose() * point.p;
  const Eigen::Matrix<double, 3, at::size> cross = J_R * e.P.middleRows<3>(at::R) + e.P.middleRows<3>(at::p);
  const Eigen::Matrix3d own = cross.middleCols<3>(at::R) * J_R.transpose() + cross.middleCols<3>(at::p);
  e.P.middleRows<3>(pc) = cross;
  e.P.middleCols<3>(pc) = cross.transpose();
  e.P.block<3, 3>(pc, pc) = 0.5 * (own + own.transpose());
  e.P.block<3, 3>(pc, pc).diagonal().array() += config.position_sigma * config.position_sigma;
}

void move_stance(Estimate& e, std::size_t side, const Eigen::Vector3d& shift) {
  const int pc = at::pcl + 3 * static_cast<int>(side);
  const Eigen::Matrix3d J = -e.x.R.matrix() * skew(shift);
  e.x.pc[side] += e.x.R * shift;
  e.P.middleRows<3>(pc) += (J * e.P.middleRows<3>(at::R)).eval();
  e.P.middleCols<3>(pc) += (e.P.middleCols<3>(at::R) * J.transpose()).eval();
}

void end_stance(Estimate& e, std::size_t side) {
  const int pc = at::pcl + 3 * static_cast<int>(side);
  e.P.middleRows<3>(pc).setZero();
  e.P.middleCols<3>(pc).setZero();
}

void StanceTracker::restart() {
  for (std::size_t side = 0; side < 2; ++side) {
    leave_[side] = leave_[side] || weights_[side].has_value();
    weights_[side].reset();
  }
  last_.reset();
}

LegStep StanceTracker::step(const Feet& feet, const ContactEstimator& contacts, const State& x, const Eigen::Vector3d& omega,
                            double sigma_v) {
  LegStep out;
  out.t = feet.t;
  out.dt = last_ ? std::clamp(to_seconds(feet.t - *last_), shortest_step, longest_step) : longest_step;
  last_ = feet.t;
  for (std::size_t side = 0; side < 2; ++side) {
    const FootPose& pose = feet.foot[side];
    Stance& foot = out.foot[side];
    foot.ends = std::exchange(leave_[side], false);
    foot.R_IF = pose.R_IF;
    const double phase = contacts.phase(side, feet.t);
    const bool stands = contacts.contacts().on[side] && phase >= config_.entry_delay;
    if (!stands) {
      foot.ends = foot.ends || weights_[side].has_value();
      weights_[side].reset();
      continue;
    }
    std::array<double, max_corners> speed2{};
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < static_cast<std::size_t>(pose.corners); ++k) {
      speed2[k] = velocity_W(x, pose.p[k], pose.v[k], omega).squaredNorm();
      least = std::min(least, speed2[k]);
    }
    Weights weights{};
    double sum = 0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(pose.corners); ++k) {
      weights[k] = std::exp((least - speed2[k]) / (2 * rolling_speed * rolling_speed));
      sum += weights[k];
    }
    foot.begins = !weights_[side].has_value();
    foot.used = true;
    for (std::size_t k = 0; k < static_cast<std::size_t>(pose.corners); ++k) {
      weights[k] /= sum;
      foot.point.p += weights[k] * pose.p[k];
      foot.point.v += weights[k] * pose.v[k];
      if (!foot.begins) foot.shift += (weights[k] - (*weights_[side])[k]) * pose.p[k];
    }
    weights_[side] = weights;
    // Eq. 8: what moves is believed less; so is what has just arrived.
    const double moving2 = velocity_W(x, foot.point.p, foot.point.v, omega).squaredNorm();
    const double entering = std::max(0.0, 1.0 - (phase - config_.entry_delay) / entry_time);
    foot.looseness =
        std::clamp(1.0 + moving2 / (config_.velocity_sigma * config_.velocity_sigma + sigma_v * sigma_v) + (loosest - 1) * entering, 1.0,
                   loosest * loosest);
  }
  return out;
}

}  // namespace kilvo
