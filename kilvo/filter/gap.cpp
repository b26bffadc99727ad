#include "kilvo/filter/gap.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo {
namespace {

// A humanoid that walks: how fast it turns and how much it leans (one sigma).
constexpr double turning = 0.4;   // rad/s
constexpr double leaning = 0.06;  // rad
// Its velocity: deviation along an axis, and the time in which it is forgotten (docs/decisions/imu-faults.md).
constexpr double wandering = 0.5;  // m/s
constexpr double memory = 2;       // s
// Its steps move it to and fro beside that, as a random walk.
constexpr double swaying = 0.1;  // m/sqrt(s)

// What is left of a velocity after so long, and the way that it has made meanwhile per m/s.
struct Left {
  double velocity, way;
  explicit Left(double dt) : velocity(std::exp(-dt / memory)), way(-memory * std::expm1(-dt / memory)) {}
};

// (2a - 3 + 4 exp(-a) - exp(-2a)), without the cancellation of small a.
double way_variance(double a) {
  if (a < 0.01) return a * a * a * (2.0 / 3 - a / 2);
  return 2 * a - 3 + 4 * std::exp(-a) - std::exp(-2 * a);
}

}  // namespace

void carry_blind(Estimate& e, Time end, const Eigen::Vector3d& rate, const ProcessNoise& noise) {
  const double dt = to_seconds(end - e.t);
  const Left left(dt);
  const SO3 turn = SO3::Exp(rate * dt);
  e.t = end;
  e.x.R = e.x.R * turn;
  e.x.p += left.way * e.x.v;
  e.x.v *= left.velocity;
  Eigen::Matrix<double, 9, 9> F = Eigen::Matrix<double, 9, 9>::Identity();
  F.block<3, 3>(at::R, at::R) = turn.matrix().transpose();
  F.block<3, 3>(at::p, at::v) = left.way * Eigen::Matrix3d::Identity();
  F.block<3, 3>(at::v, at::v) = left.velocity * Eigen::Matrix3d::Identity();
  e.P.topRows<9>() = (F * e.P.topRows<9>()).eval();
  e.P.leftCols<9>() = (e.P.leftCols<9>() * F.transpose()).eval();
  e.P.diagonal().segment<3>(at::bg).array() += noise.gyro_bias * noise.gyro_bias * dt;
  e.P.diagonal().segment<3>(at::ba).array() += noise.accel_bias * noise.accel_bias * dt;
  e.P(at::tau, at::tau) += noise.exposure * noise.exposure * dt;
  e.P = (0.5 * (e.P + e.P.transpose())).eval();
}

void inflate_covariance_over_gap(Estimate& e, Time begin, Time end, double gap) {
  const double dt = to_seconds(end - begin), share = gap > 0 ? std::clamp(dt / gap, 0.0, 1.0) : 1.0;
  const double lean = std::min(leaning, turning * gap), turn = turning * gap;
  // Leaning is about the horizontal, turning about the vertical.
  const Eigen::Vector3d up_I = e.x.R.matrix().transpose() * -e.x.g.normalized();
  e.P.block<3, 3>(at::R, at::R) +=
      share * (lean * lean * Eigen::Matrix3d::Identity() + std::max(0.0, turn * turn - lean * lean) * up_I * up_I.transpose());
  const double variance = wandering * wandering, way = Left(dt).way;
  e.P.diagonal().segment<3>(at::v).array() -= variance * std::expm1(-2 * dt / memory);
  e.P.diagonal().segment<3>(at::p).array() += variance * memory * memory * way_variance(dt / memory) + swaying * swaying * dt;
  e.P.diagonal(at::v - at::p).segment<3>(at::p).array() += variance * way * way / memory;
  e.P.diagonal(at::p - at::v).segment<3>(at::p).array() += variance * way * way / memory;
}

}  // namespace kilvo
