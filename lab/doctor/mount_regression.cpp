#include "lab/doctor/mount_regression.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "kilvo/filter/pose_error.hpp"
#include "kilvo/filter/predict.hpp"

namespace kilvo::lab {
namespace {

constexpr Duration score_length = std::chrono::seconds(2);  // longer than what a model gets wrong lasts
constexpr int fewest_scores = 5;
constexpr Duration settling = std::chrono::seconds(3);  // after which the biases follow from innovations
constexpr double score_freedom = 6;                     // degrees, of the innovations' distribution (Student)
constexpr double unknown = 0.1;                         // rad and m: standard deviation of what nothing is known of

// Standard deviations of the place, m, of mounts that were calibrated, designed, and measured by hand. What tilts a bracket by an angle
// moves its end by the angle times a length of a metre.
constexpr std::array<double, 3> exactness = {3e-4, 2e-3, 5e-3};
constexpr double bracket = 1;  // m

// Squared, per covariance, of three axes (99.9 % of chi-square): a shift that is less likely than this, were it described as badly as any
// mount is, shows an error of the measurement.
constexpr double unlikely = 16.27;

}  // namespace

std::optional<Eigen::Vector3d> expected_shift(const MountMeasurement& measured, const Eigen::Vector3d& turned) {
  const Eigen::Vector3d measured_shift = measured.error.tail<3>();
  Eigen::Matrix3d widest = measured.covariance.bottomRightCorner<3, 3>();
  widest.diagonal().array() += exactness.back() * exactness.back();
  if (measured_shift.dot(widest.ldlt().solve(measured_shift)) > unlikely) return std::nullopt;
  constexpr double of_a_bracket = 0.05;  // rad: a larger turn is that of another convention, and says nothing of how exact it is
  Eigen::Matrix<double, 6, 1> error = measured.error;
  if (turned.norm() < of_a_bracket) error.head<3>() += turned;
  std::array<double, exactness.size()> logarithm;
  std::array<Eigen::Vector3d, exactness.size()> shift;
  for (std::size_t i = 0; i < exactness.size(); ++i) {
    const double variance = exactness[i] * exactness[i];
    PoseCovariance S = measured.covariance;
    S.diagonal().head<3>().array() += variance / (bracket * bracket);
    S.diagonal().tail<3>().array() += variance;
    const Eigen::LDLT<PoseCovariance> factored(S);
    logarithm[i] = -0.5 * (factored.vectorD().array().log().sum() + error.dot(factored.solve(error)));
    // What it was turned by says how exact the description is, and no more: that has been corrected.
    shift[i] = variance * S.bottomRightCorner<3, 3>().ldlt().solve(measured_shift);
  }
  const double largest = std::ranges::max(logarithm);
  double weights = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < exactness.size(); ++i) {
    const double weight = std::exp(logarithm[i] - largest);
    weights += weight;
    mean += weight * shift[i];
  }
  if (std::exp(logarithm[0] - largest) > 0.5 * weights) return std::nullopt;
  return mean / weights;
}

// How the poses that sweeps and the described mount make depend on the parameters.
MountRegression::PoseJacobian MountRegression::of_pose(const State& x, const Eigen::Vector3d& rate) const {
  PoseJacobian J = PoseJacobian::Zero();
  J.block<3, 3>(at::R, of::turn).setIdentity();
  J.block<3, 3>(at::p, of::turn) = x.R.matrix() * skew(T_IL_.p);
  J.block<3, 3>(at::p, of::shift) = x.R.matrix();
  J.block<3, 1>(at::R, of::clock) = rate;
  J.block<3, 1>(at::p, of::clock) = x.v;
  return J;
}

void MountRegression::begin(const Estimate& e, const Eigen::Vector3d& rate) {
  D_.setZero();
  begun_ = e.t;
  resting_force_ = -(e.x.R.inverse() * e.x.g);
  of_map_ = to_origin(e.x.pose()) * of_pose(e.x, rate);
  block_.setZero();
  block_begin_ = e.t + settling;
}

void MountRegression::propagate(const Estimate& from, Time until, std::span<const ImuSample> imu) {
  Estimate e = from;
  for (std::size_t i = 1; i < imu.size() && e.t < until; ++i) {
    if (imu[i].t <= e.t) continue;
    const ImuInterval interval = ImuInterval::between(imu[i - 1], imu[i], e.t, std::min(until, imu[i].t));
    const Eigen::Vector3d force = 0.5 * (interval.accel_begin + interval.accel_end) - e.x.ba - resting_force_;
    const Eigen::Vector3d rate = 0.5 * (interval.gyro_begin + interval.gyro_end) - e.x.bg;
    auto S = D_;  // axes that are wrong are biases that change
    for (int k = 0; k < 3; ++k) {
      S.block<3, 3>(at::ba, of::accel + 3 * k).diagonal().array() += force[k];
      S.block<3, 3>(at::bg, of::gyro + 3 * k).diagonal().array() += rate[k];
      S.block<3, 3>(at::bg, of::push + 3 * k).diagonal().array() += force[k];
    }
    Transition F;
    carry(e, interval, {}, {}, &F);
    D_.topRows<Transition::RowsAtCompileTime>() = F.leftCols<states>() * S;
  }
}

void MountRegression::add(const Estimate& from, const Estimate& prior, const Estimate& posterior, std::span<const ImuSample> imu) {
  const auto is_gap = [](const ImuSample& a, const ImuSample& b) { return to_seconds(b.t - a.t) > blind_gap; };
  if (imu.empty() || imu.front().t > from.t || imu.back().t < prior.t || std::ranges::adjacent_find(imu, is_gap) != imu.end())
    return last_.reset();
  const auto after = std::ranges::lower_bound(imu, prior.t, {}, &ImuSample::t);
  const ImuSample& before = after == imu.begin() ? *after : *std::prev(after);
  const Eigen::Vector3d rate = ImuInterval::between(before, *after, prior.t, prior.t).gyro_begin - prior.x.bg;
  const bool follows = last_ && last_->t == from.t && last_->x.p == from.x.p;
  last_ = posterior;
  if (!follows) return begin(posterior, rate);
  propagate(from, prior.t, imu);

  const PoseJacobian G = D_.topRows<6>() + of_pose(prior.x, rate) - from_origin(prior.x.pose()) * of_map_;
  const PoseCovariance P_inverse = (prior.P.topLeftCorner<6, 6>() + 1e-14 * PoseCovariance::Identity()).inverse();
  const Eigen::Matrix<double, at::size, 6> taken = (prior.P - posterior.P).leftCols<6>() * P_inverse;  // gain times Jacobian
  const PoseCovariance known = P_inverse * taken.topRows<6>();  // inverse of the innovations' covariance, seen in the pose
  const Eigen::Matrix<double, 6, 1> step = boxminus(posterior.x, prior.x).head<6>();
  const Eigen::Matrix<double, 6, 1> pull = P_inverse * step;
  const double squared = pull.dot(known.completeOrthogonalDecomposition().solve(pull));
  if (!std::isfinite(squared) || !known.allFinite() || !G.allFinite()) return last_.reset();
  D_ -= taken.topRows<states>() * G;
  // What the biases were when it began depends on the parameters in a way that is not known.
  if (posterior.t - begun_ < settling) return;
  const double weight = (score_freedom + 6) / (score_freedom + std::max(0.0, squared));
  const Eigen::Matrix<double, of::size, 6> weighed = weight * G.transpose();
  N_ += weighed * known * G;
  n_ += weighed * pull;
  block_ += weighed * (pull - known * (G * expected_));

  if (posterior.t - block_begin_ < score_length) return;
  scatter_ += block_ * block_.transpose();
  ++blocks_;
  block_.setZero();
  block_begin_ = posterior.t;
  expected_ = solved(exactness.back()).x;
}

MountRegression::Solution MountRegression::solved(double mount) const {
  constexpr double clock = 5e-3, axes = 6e-3, push = 1e-3;  // s, -, rad/s per m/s^2: of IMUs of robots
  Parameters sigma;
  sigma << Eigen::Matrix<double, 6, 1>::Constant(mount), clock, Eigen::Matrix<double, 18, 1>::Constant(axes),
      Eigen::Matrix<double, 9, 1>::Constant(push);
  ParameterMatrix A = N_;
  A.diagonal() += sigma.cwiseAbs2().cwiseInverse();
  const Eigen::LLT<ParameterMatrix> factored(A);
  return {factored.solve(n_), factored.solve(ParameterMatrix::Identity())};
}

std::optional<MountMeasurement> MountRegression::measured() const {
  if (blocks_ < fewest_scores) return std::nullopt;
  const Solution s = solved(unknown);
  // Where the sums of a block vary by more than the filter expects, its model is wrong, and the covariance is larger by as much
  // (P. J. Huber, "The behavior of maximum likelihood estimates under nonstandard conditions", 1967).
  const Solution usual = solved(exactness.back());
  const Eigen::Vector3d shown = (usual.covariance * scatter_ * usual.covariance).diagonal().segment<3>(of::shift);
  const double excess = std::max(1.0, shown.cwiseQuotient(usual.covariance.diagonal().segment<3>(of::shift)).mean());
  const MountMeasurement out{s.x.head<6>(), excess * s.covariance.topLeftCorner<6, 6>()};
  if (!out.error.allFinite() || !out.covariance.allFinite() || !(out.covariance.diagonal().minCoeff() > 0)) return std::nullopt;
  return out;
}

}  // namespace kilvo::lab
