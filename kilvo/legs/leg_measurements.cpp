#include "kilvo/legs/leg_measurements.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace kilvo {
namespace {

// The corners of a rolling sole that are this much faster than the slowest one carry e^-0.5 of its weight, m/s.
constexpr double rolling_speed = 0.005;
// alpha_s of Eq. 8, of the standard deviation.
constexpr double loosest = 10;
// Soles settle and roll: by so much more, in variance, a foot may move before it is refused.
constexpr double room_to_settle = 20;
// Refused for so long, a foot has another place.
constexpr Duration longest_refusal = std::chrono::milliseconds(20);
// Encoders that repeat every bit for so long, while the other foot's do not and the body turns faster than this (rad/s), are frozen.
constexpr Duration longest_stillness = std::chrono::milliseconds(50);
constexpr double surely_turning = 0.1;
// How much one touchdown counts in what is learned of the ground.
constexpr double sink_share = 0.15;
// A foot enters loosely and settles over this time, s.
constexpr double entry_time = 0.02;
constexpr double shortest_step = 1e-4, longest_step = 0.05;  // s

// How much each corner of a sole carries, which adds up to one, and the square of the least speed of a corner, m^2/s^2.
struct CornerShare {
  std::array<double, max_corners> weights{};
  double least = std::numeric_limits<double>::infinity();
};

CornerShare share_of_corners(const FootPose& pose, const State& x, const Eigen::Vector3d& omega) {
  CornerShare out;
  std::array<double, max_corners> speed2{};
  const auto corners = static_cast<std::size_t>(pose.corners);
  for (std::size_t k = 0; k < corners; ++k) {
    speed2[k] = velocity_W(x, pose.p[k], pose.v[k], omega).squaredNorm();
    out.least = std::min(out.least, speed2[k]);
  }
  double sum = 0;
  for (std::size_t k = 0; k < corners; ++k) {
    out.weights[k] = std::exp((out.least - speed2[k]) / (2 * rolling_speed * rolling_speed));
    sum += out.weights[k];
  }
  for (std::size_t k = 0; k < corners; ++k) out.weights[k] /= sum;
  return out;
}

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

FootHeightRow foot_height(const GroundPatch& ground, const Eigen::Vector3d& pc) {
  return {ground.height_of(pc), ground.normal.transpose()};
}

// The chi-square gate, velocity and position each by itself, as they are and not as densities: is this foot moving, has it moved? Not
// with the variance_scale of Eq. 8, which grows with the speed and would let everything pass.
bool LegModel::moves(const Covariance& prior, std::size_t side, const Eigen::Vector3d& velocity, const Eigen::Vector3d& offset) const {
  const int pc = at::pcl + 3 * static_cast<int>(side);
  const double gate2 = config_.gate * config_.gate;
  Eigen::Matrix3d S = prior.block<3, 3>(at::v, at::v);
  S.diagonal().array() += room_to_settle * config_.velocity_sigma * config_.velocity_sigma;
  if (velocity.dot(S.llt().solve(velocity)) > gate2) return true;
  S = prior.block<3, 3>(at::p, at::p) + prior.block<3, 3>(pc, pc) - prior.block<3, 3>(at::p, pc) - prior.block<3, 3>(pc, at::p);
  S.diagonal().array() += room_to_settle * config_.position_sigma * config_.position_sigma;
  return offset.dot(S.llt().solve(offset)) > gate2;
}

// Velocity and position of one foot as rows `count` to `count` + 5; false, and no rows, when it moves.
bool LegModel::add_motion(LegRows& rows, int count, std::size_t side, const State& x, const Covariance& prior) const {
  const Stance& foot = step_.foot[side];
  const int pc = at::pcl + 3 * static_cast<int>(side);
  const FootVelocityRow v = foot_velocity(x, foot.point, gyro_);
  const FootPositionRow p = foot_position(x, foot.point, x.pc[side]);
  const double velocity2 = config_.velocity_sigma * config_.velocity_sigma, position2 = config_.position_sigma * config_.position_sigma;
  if (moves(prior, side, v.r, p.r)) return false;
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
  // A density: rows within one correlation time say it once together.
  const double dt = step_.dt;
  const double along = std::max(1.0, config_.velocity_correlation / dt) * foot.variance_scale;
  const Eigen::Vector3d up_W = -x.g.normalized();
  const double vertical2 = config_.vertical_velocity_sigma * config_.vertical_velocity_sigma;
  rows.R.block<3, 3>(count, count) = along * (vertical2 - velocity2) * up_W * up_W.transpose();
  rows.R.diagonal().segment<3>(count).array() += along * velocity2;
  rows.R.diagonal().segment<3>(count + 3).setConstant(foot.variance_scale * position2 * std::max(1.0, config_.position_correlation / dt));
  if (foot.row_scale) {
    const Eigen::Matrix<double, 6, 1> scale = foot.row_scale->head<6>().cwiseSqrt();
    rows.R.block<6, 6>(count, count) = (scale.asDiagonal() * rows.R.block<6, 6>(count, count) * scale.asDiagonal()).eval();
  }
  return true;
}

// The height of one foot over the ground as row `count`; false, and no row, when it came down on something else.
bool LegModel::add_height(LegRows& rows, int count, std::size_t side, const State& x, const Covariance& prior) const {
  const auto& ground = step_.foot[side].ground;
  if (!ground) return false;
  const int pc = at::pcl + 3 * static_cast<int>(side);
  const FootHeightRow h = foot_height(*ground, x.pc[side]);
  const double scale = step_.foot[side].row_scale ? (*step_.foot[side].row_scale)[6] : 1.0;
  const double variance = scale * (ground->sigma * ground->sigma + config_.ground_sigma * config_.ground_sigma);
  const double spread = h.J_pc * prior.block<3, 3>(pc, pc) * h.J_pc.transpose();
  if (h.r * h.r > config_.gate * config_.gate * (spread + variance)) return false;
  rows.H.block<1, 3>(count, pc) = h.J_pc;
  rows.r[count] = h.r;
  rows.R(count, count) = variance;
  return true;
}

LegModel::LegRows LegModel::operator()(const State& x, const Covariance& prior) {
  LegRows rows;
  rows.r.resize(max_leg_rows);
  rows.H.setZero(max_leg_rows, at::size);
  rows.R.setZero(max_leg_rows, max_leg_rows);
  int count = 0;
  for (std::size_t side = 0; side < 2; ++side) {
    used_.motion[side] = step_.foot[side].used && add_motion(rows, count, side, x, prior);
    if (used_.motion[side]) count += 6;
    used_.height[side] = used_.motion[side] && add_height(rows, count, side, x, prior);
    if (used_.height[side]) ++count;
  }
  rows.r.conservativeResize(count);
  rows.H.conservativeResize(count, at::size);
  rows.R.conservativeResize(count, count);
  return rows;
}

Residual<LegModel::max_leg_rows> LegModel::residual(const LegStep& step, const State& x, const Eigen::Vector3d& gyro, const Used& used) {
  Residual<max_leg_rows> r(max_leg_rows);
  int count = 0;
  for (std::size_t side = 0; side < 2; ++side) {
    if (!used.motion[side]) continue;
    const Stance& foot = step.foot[side];
    r.segment<3>(count) = foot_velocity(x, foot.point, gyro).r;
    r.segment<3>(count + 3) = foot_position(x, foot.point, x.pc[side]).r;
    count += 6;
    if (used.height[side]) r[count++] = foot_height(*foot.ground, x.pc[side]).r;
  }
  r.conservativeResize(count);
  return r;
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

void place_stances(State& x, const LegStep& step) {
  for (std::size_t side = 0; side < 2; ++side) {
    const Stance& foot = step.foot[side];
    if (foot.begins) x.pc[side] = x.pose() * foot.point.p;
    if (foot.used && !foot.begins) x.pc[side] += x.R * foot.shift;
  }
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

void StanceTracker::judge(const LegStep& step, const std::array<bool, 2>& passed) {
  for (std::size_t side = 0; side < 2; ++side) {
    if (!step.foot[side].used || passed[side]) {
      refused_[side].reset();
      continue;
    }
    if (!refused_[side]) refused_[side] = step.t;
    if (step.t - *refused_[side] < longest_refusal) continue;
    refused_[side].reset();
    leave_[side] = slid_[side] = true;
    weights_[side].reset();
  }
}

// A sole sinks into soft ground, grass hides it from the LiDAR, few points near the robot make a plane that is off: all of that is alike
// from step to step, so what it was while the LiDAR knew the height is taken off when it does not.
std::optional<GroundPatch> StanceTracker::ground_under(const VoxelMap& map, const Eigen::Vector3d& p_W, const Eigen::Vector3d& up_W,
                                                       Ground ground) {
  auto patch = GroundLookup::of_map(map, p_W, up_W);
  if (!patch) return std::nullopt;
  if (ground == Ground::learn) {
    const double off = patch->height_of(p_W) - sink_;
    sink_ += sink_share * off;
    sink_variance_ += sink_share * (off * off - sink_variance_);
    return std::nullopt;
  }
  patch->point += sink_ * patch->normal;
  patch->sigma = std::sqrt(patch->sigma * patch->sigma + sink_variance_);
  return patch;
}

// A foot that slid away stands again when it is slow.
bool StanceTracker::may_stand(std::size_t side, double speed2, double sigma_v) {
  const double rest2 = loosest * config_.velocity_sigma * config_.velocity_sigma + config_.gate * config_.gate * sigma_v * sigma_v;
  slid_[side] = slid_[side] && speed2 > rest2;
  return !slid_[side];
}

// True while the encoders of this foot are frozen.
bool StanceTracker::stuck(std::size_t side, const Feet& feet, const Eigen::Vector3d& omega) {
  const FootPose& now = feet.foot[side];
  FootPose& last = last_pose_[side];
  if (now.corners != last.corners || now.p[0] != last.p[0] || now.v[0] != last.v[0]) changed_[side] = feet.t;
  last = now;
  return feet.t - changed_[side] > longest_stillness && changed_[1 - side] > changed_[side] && omega.norm() > surely_turning;
}

LegStep StanceTracker::step(const Feet& feet, const Contacts& contacts, const State& x, const Eigen::Vector3d& omega, double sigma_v,
                            const VoxelMap* map, Ground ground) {
  LegStep out;
  out.t = feet.t;
  out.dt = last_ ? std::clamp(to_seconds(feet.t - *last_), shortest_step, longest_step) : longest_step;
  last_ = feet.t;
  for (std::size_t side = 0; side < 2; ++side) {
    const FootPose& pose = feet.foot[side];
    Stance& foot = out.foot[side];
    foot.ends = std::exchange(leave_[side], false);
    foot.R_IF = pose.R_IF;
    const double phase = contacts.phase(side);
    const auto [weights, least] = share_of_corners(pose, x, omega);
    const bool stands = contacts.on[side] && phase >= config_.entry_delay;
    if (stuck(side, feet, omega) || !stands || !may_stand(side, least, sigma_v)) {
      foot.ends = foot.ends || weights_[side].has_value();
      weights_[side].reset();
      slid_[side] = slid_[side] && stands;
      continue;
    }
    foot.begins = !weights_[side].has_value();
    foot.used = true;
    for (std::size_t k = 0; k < static_cast<std::size_t>(pose.corners); ++k) {
      foot.point.p += weights[k] * pose.p[k];
      foot.point.v += weights[k] * pose.v[k];
      if (!foot.begins) foot.shift += (weights[k] - (*weights_[side])[k]) * pose.p[k];
    }
    weights_[side] = weights;
    if (foot.begins && map != nullptr) foot.ground = ground_under(*map, x.pose() * foot.point.p, -x.g.normalized(), ground);
    // Eq. 8: what moves is believed less; so is what has just arrived.
    const double moving2 = velocity_W(x, foot.point.p, foot.point.v, omega).squaredNorm();
    const double noise2 = config_.velocity_sigma * config_.velocity_sigma + sigma_v * sigma_v;
    const double entering = std::max(0.0, 1.0 - (phase - config_.entry_delay) / entry_time);
    // As much as the noise across on all three axes is no motion.
    const double loose = 1.0 + std::max(0.0, moving2 / noise2 - 3.0) + (loosest - 1) * entering;
    foot.variance_scale = std::min(loose, loosest * loosest);
  }
  return out;
}

}  // namespace kilvo
