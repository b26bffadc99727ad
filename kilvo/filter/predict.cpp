#include "kilvo/filter/predict.hpp"

#include <cassert>

#include "kilvo/filter/gain.hpp"

namespace kilvo {
namespace {

// The motion of one interval: rotation R0 -> R1, specific force turned into the world at both ends and taken as linear between.
struct Motion {
  double dt;
  Eigen::Vector3d phi;  // rotation vector of the interval
  SO3 turn;             // Exp(phi)
  SO3 R1;
  Eigen::Vector3d alpha0, alpha1;  // bias-free specific force in the body at both ends
  Eigen::Vector3d f0, f1;          // the same in the world
};

Motion motion_of(const State& x, const ImuInterval& i) {
  Motion m;
  m.dt = to_seconds(i.end - i.begin);
  m.phi = (0.5 * (i.gyro_begin + i.gyro_end) - x.bg) * m.dt;
  m.turn = SO3::Exp(m.phi);
  m.R1 = x.R * m.turn;
  m.alpha0 = i.accel_begin - x.ba;
  m.alpha1 = i.accel_end - x.ba;
  m.f0 = x.R * m.alpha0;
  m.f1 = m.R1 * m.alpha1;
  return m;
}

State mean_after(const State& x, const Motion& m) {
  State y = x;
  y.R = m.R1;
  y.p = x.p + m.dt * x.v + m.dt * m.dt * (m.f0 / 3.0 + m.f1 / 6.0 + 0.5 * x.g);
  y.v = x.v + m.dt * (0.5 * (m.f0 + m.f1) + x.g);
  return y;
}

// d(f0)/d(theta), d(f1)/d(theta), d(f1)/d(bg); d(f)/d(ba) = -R.
struct ForceJacobians {
  Eigen::Matrix3d f0_theta, f1_theta, f1_bg, Jr;
};

ForceJacobians jacobians_of(const State& x, const Motion& m) {
  ForceJacobians j;
  j.Jr = right_jacobian(m.phi);
  j.f0_theta = -x.R.matrix() * skew(m.alpha0);
  const Eigen::Matrix3d turned = m.R1.matrix() * skew(m.alpha1);
  j.f1_theta = -turned * m.turn.matrix().transpose();
  j.f1_bg = turned * j.Jr * m.dt;
  return j;
}

constexpr int moving = Transition::RowsAtCompileTime;

// P becomes F P F', where F is the identity below its first rows. Each row of F P is a sum of columns of P, which is symmetric.
void move(const Transition& F, Covariance& P) {
  Eigen::Matrix<double, at::size, moving> out;
  Eigen::Matrix<double, moving, moving> N = Eigen::Matrix<double, moving, moving>::Zero();  // F P F' of those rows
  project_rows(P, F.data(), moving, N.data(), out.data());
  for (int k = 0; k < moving; ++k) {
    for (int i = 0; i <= k; ++i) P(i, k) = P(k, i) = N(k, i);
    for (int j = moving; j < at::size; ++j) P(k, j) = P(j, k) = out(j, k);
  }
}

void add_process_noise(Covariance& P, const Motion& m, const Eigen::Vector3d& up_W, const StandingFeet& feet, const ProcessNoise& n,
                       const ImuInterval& interval) {
  const double dt = m.dt, scale = interval.made_biases ? 0 : 1;
  const auto add = [&P](int row, int col, double value) { P.diagonal(col - row).segment<3>(std::min(row, col)).array() += value; };
  const double accel = scale * (n.accel * n.accel + interval.more_accel);
  add(at::R, at::R, scale * interval.gyro_scale * (n.gyro * n.gyro + interval.more_gyro) * dt);
  add(at::v, at::v, accel * dt);
  add(at::p, at::v, accel * dt * dt / 2);
  add(at::v, at::p, accel * dt * dt / 2);
  add(at::p, at::p, accel * dt * dt * dt / 3 + scale * interval.velocity_scale * n.velocity * n.velocity * dt);
  add(at::bg, at::bg, n.gyro_bias * n.gyro_bias * dt);
  add(at::ba, at::ba, n.accel_bias * n.accel_bias * dt);
  for (int foot = 0; foot < 2; ++foot) {
    // A foot that does not stand gets none. Round gravity it is isotropic, so the foot's orientation drops out (paper, Eq. 2: it turns).
    if (!feet[static_cast<std::size_t>(foot)]) continue;
    const int pc = at::pcl + 3 * foot;
    add(pc, pc, n.foot * n.foot * dt);
    P.block<3, 3>(pc, pc) += (n.foot_vertical * n.foot_vertical - n.foot * n.foot) * dt * up_W * up_W.transpose();
  }
  P(at::tau, at::tau) += n.exposure * n.exposure * dt;
}

}  // namespace

ImuInterval ImuInterval::between(const ImuSample& a, const ImuSample& b, Time begin, Time end) {
  const double span = to_seconds(b.t - a.t);
  const double s0 = span > 0 ? to_seconds(begin - a.t) / span : 0.0;
  const double s1 = span > 0 ? to_seconds(end - a.t) / span : 1.0;
  return {begin,
          end,
          a.gyro + s0 * (b.gyro - a.gyro),
          a.gyro + s1 * (b.gyro - a.gyro),
          a.accel + s0 * (b.accel - a.accel),
          a.accel + s1 * (b.accel - a.accel)};
}

State predict_mean(const State& x, const ImuInterval& interval) { return mean_after(x, motion_of(x, interval)); }

void carry(Estimate& e, const ImuInterval& interval, const StandingFeet& feet, const ProcessNoise& noise, Transition* kept) {
  assert(interval.begin == e.t && interval.end >= interval.begin);
  const Motion m = motion_of(e.x, interval);
  const ForceJacobians j = jacobians_of(e.x, m);
  const double dt = m.dt, dt2 = dt * dt;

  // F differs from the identity only in the rows of R, p, v.
  const Eigen::Matrix3d R0 = e.x.R.matrix();
  const Eigen::Matrix3d& R1 = m.R1.matrix();
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  Transition F = Transition::Zero();
  F.block<3, 3>(at::R, at::R) = m.turn.matrix().transpose();
  F.block<3, 3>(at::R, at::bg) = -j.Jr * dt;
  F.block<3, 3>(at::p, at::R) = dt2 * (j.f0_theta / 3.0 + j.f1_theta / 6.0);
  F.block<3, 3>(at::p, at::p) = I;
  F.block<3, 3>(at::p, at::v) = dt * I;
  F.block<3, 3>(at::p, at::bg) = (dt2 / 6.0) * j.f1_bg;
  F.block<3, 3>(at::p, at::ba) = -dt2 * (R0 / 3.0 + R1 / 6.0);
  F.block<3, 3>(at::p, at::g) = (0.5 * dt2) * I;
  F.block<3, 3>(at::v, at::R) = 0.5 * dt * (j.f0_theta + j.f1_theta);
  F.block<3, 3>(at::v, at::v) = I;
  F.block<3, 3>(at::v, at::bg) = 0.5 * dt * j.f1_bg;
  F.block<3, 3>(at::v, at::ba) = -0.5 * dt * (R0 + R1);
  F.block<3, 3>(at::v, at::g) = dt * I;
  // By the end of the window that the biases are means of, their error has taken back what the noise of the samples did; of gravity and
  // the accelerometer's bias the mean holds the sum.
  if (interval.made_biases) F.middleCols<at::pcl - at::bg>(at::bg).setZero();
  move(F, e.P);
  if (kept != nullptr) *kept = F;
  add_process_noise(e.P, m, -e.x.g.normalized(), feet, noise, interval);
  e.t = interval.end;
  e.x = mean_after(e.x, m);
}

}  // namespace kilvo
