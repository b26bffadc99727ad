#include "kilvo/legs/leg_measurements.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo {
FootVelocityRow foot_velocity(const State& x, const SolePoint& point, const Eigen::Vector3d& gyro) {
  const Eigen::Matrix3d& R = x.R.matrix();
  const Eigen::Vector3d s = (gyro - x.bg).cross(point.p) + point.v;
  return {x.v + R * s, -R * skew(s), Eigen::Matrix3d::Identity(), R * skew(point.p)};
}

FootPositionRow foot_position(const State& x, const SolePoint& point, const Eigen::Vector3d& pc) {
  const Eigen::Matrix3d& R = x.R.matrix();
  return {x.p + R * point.p - pc, -R * skew(point.p), Eigen::Matrix3d::Identity(), -Eigen::Matrix3d::Identity()};
}

FootHeightRow foot_height(const GroundPatch& ground, const State& x, const Eigen::Vector3d& pc) {
  if (!ground.measures_gravity) return {ground.height_of(pc), ground.normal.transpose()};
  const Eigen::Vector3d up = -x.g.normalized(), d = pc - ground.point;
  const double height = up.dot(d);
  return {height, up.transpose(), (height * up - d).transpose() / x.g.norm()};
}

// Velocity and position of one foot as rows `count` to `count` + 5.
void LegModel::add_motion(LegRows& rows, int count, std::size_t side, const State& x, const Covariance& prior) {
  const Stance& foot = step_.foot[side];
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

  const double velocity2 = step_.velocity_sigma * step_.velocity_sigma, position2 = config_.position_sigma * config_.position_sigma;
  const double vertical2 = step_.vertical_velocity_sigma * step_.vertical_velocity_sigma;
  // How far off they are, as they are and not as densities.
  Eigen::Matrix3d Sv = prior.block<3, 3>(at::v, at::v);
  Sv.diagonal().array() += room_to_settle * velocity2;
  Eigen::Matrix3d Sp =
      prior.block<3, 3>(at::p, at::p) + prior.block<3, 3>(pc, pc) - prior.block<3, 3>(at::p, pc) - prior.block<3, 3>(pc, at::p);
  Sp.diagonal().array() += room_to_settle * position2;
  const double gate2 = config_.gate * config_.gate, chi2_v = v.r.dot(Sv.llt().solve(v.r)), chi2_p = p.r.dot(Sp.llt().solve(p.r));
  used_.fits[side] = chi2_p < gate2 && chi2_v < gate2;
  // Beyond the gate they count as one at the gate does (Huber).
  const double loose_v = foot.variance_scale * std::max(1.0, std::sqrt(chi2_v / gate2)),
               loose_p = foot.variance_scale * std::max(1.0, std::sqrt(chi2_p / gate2));
  // A density: rows within one correlation time count as one.
  const double dt = step_.dt;
  const double along = std::max(1.0, config_.velocity_correlation / dt) * loose_v;
  const Eigen::Vector3d up_W = -x.g.normalized();
  rows.R.block<3, 3>(count, count) = along * (vertical2 - velocity2) * up_W * up_W.transpose();
  rows.R.diagonal().segment<3>(count).array() += along * velocity2;
  rows.R.diagonal().segment<3>(count + 3).setConstant(loose_p * position2 * std::max(1.0, config_.position_correlation / dt));
  if (foot.row_scale) {
    const Eigen::Matrix<double, 6, 1> scale = foot.row_scale->head<6>().cwiseSqrt();
    rows.R.block<6, 6>(count, count) = (scale.asDiagonal() * rows.R.block<6, 6>(count, count) * scale.asDiagonal()).eval();
  }
}

// The height of one foot over the ground as row `count`; false, and no row, when it came down on something else.
bool LegModel::add_height(LegRows& rows, int count, std::size_t side, const State& x, const Covariance& prior) const {
  const auto& ground = step_.foot[side].ground;
  const auto& level = step_.foot[side].level;
  if (!ground && !level) return false;
  const int pc = at::pcl + 3 * static_cast<int>(side), other = at::pcl + 3 * (1 - static_cast<int>(side));
  FootHeightRow h = ground ? foot_height(*ground, x, x.pc[side])
                           : FootHeightRow{level->normal.dot(x.pc[side] - x.pc[1 - side]), level->normal.transpose()};
  const double scale = step_.foot[side].row_scale ? (*step_.foot[side].row_scale)[6] : 1.0;
  const double variance = ground ? scale * ground->sigma * ground->sigma : level->sigma * level->sigma;
  Eigen::Matrix3d S = prior.block<3, 3>(pc, pc);
  if (!ground) S += prior.block<3, 3>(other, other) - prior.block<3, 3>(pc, other) - prior.block<3, 3>(other, pc);
  const double spread =
      h.J_pc * S * h.J_pc.transpose() + (2 * h.J_pc * prior.block<3, 3>(pc, at::g) + h.J_g * prior.block<3, 3>(at::g, at::g)).dot(h.J_g);
  const double gate = ground ? config_.gate : 3;
  if (h.r * h.r > gate * gate * (spread + variance)) return false;
  rows.H.block<1, 3>(count, pc) = h.J_pc;
  rows.H.block<1, 3>(count, at::g) = h.J_g;
  if (!ground) rows.H.block<1, 3>(count, other) = -h.J_pc;
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
    used_.motion[side] = step_.foot[side].used;
    if (!used_.motion[side]) continue;
    add_motion(rows, count, side, x, prior);
    count += 6;
    used_.height[side] = add_height(rows, count, side, x, prior);
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
    if (!used.height[side]) continue;
    r[count++] = foot.ground ? foot_height(*foot.ground, x, x.pc[side]).r : foot.level->normal.dot(x.pc[side] - x.pc[1 - side]);
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

void move_stance(Estimate& e, std::size_t side, const Stance& foot) {
  const int pc = at::pcl + 3 * static_cast<int>(side);
  const Eigen::Matrix3d J = -e.x.R.matrix() * skew(foot.shift);
  e.x.pc[side] += e.x.R * foot.shift;
  // The rows first, which are the columns of a symmetric matrix; then the columns, by rows that have moved.
  Eigen::Matrix<double, at::size, 3> moved = e.P.middleCols<3>(at::R) * J.transpose();
  e.P.middleRows<3>(pc) += moved.transpose();
  moved.middleRows<3>(pc) = e.P.block<3, 3>(pc, at::R) * J.transpose();
  e.P.middleCols<3>(pc) += moved;
  e.P.block<2, 2>(pc, pc).diagonal().array() += foot.slide_variance;
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

}  // namespace kilvo
