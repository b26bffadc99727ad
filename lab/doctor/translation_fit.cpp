#include "lab/doctor/translation_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "lab/doctor/robust_fit.hpp"
#include "lab/doctor/turns.hpp"

namespace kilvo::lab {
namespace {

using Matrix39 = Eigen::Matrix<double, 3, 9>;
using Vector9 = Eigen::Matrix<double, 9, 1>;

constexpr double accel_bias_prior = 0.15;   // m/s^2
constexpr double position_prior = 1;        // m
constexpr double accel_axes_prior = 0.005;  // of an element: scale and misalignment of an IMU of a robot
constexpr double weak = 0.02;               // share of the sweep's information; below it the LiDAR does not know its way
constexpr std::size_t fewest_rows = 40;     // rows
constexpr double freedom = 12;              // degrees, of the rows' distribution (Student)

// Velocity and place that a constant force in the IMU frame (one column for each element of the axes) gives from a to b, in the frame of
// the IMU at a. Each sample holds until the middle between its neighbours.
struct Integral {
  Matrix39 v = Matrix39::Zero(), p = Matrix39::Zero();
  Eigen::Matrix3d v_bias = Eigen::Matrix3d::Zero(), p_bias = Eigen::Matrix3d::Zero();
  // Of the squared velocities that the samples add beyond gravity: by the square of the share of the time that has passed, that is left,
  // and by their product.
  double past = 0, left = 0, product = 0;
};

Integral integrate(const std::vector<InertialSample>& imu, const GyroPath& gyro, double a, double b) {
  Integral out;
  auto it = std::ranges::lower_bound(imu, a, {}, &InertialSample::t);
  if (it != imu.begin()) --it;
  const Eigen::Quaterniond R_a = gyro.at(a).conjugate();
  for (; it != imu.end() && it->t < b; ++it) {
    const auto next = std::next(it);
    if (next == imu.end()) break;
    const double from = std::max(a, it->t), to = std::min(b, next->t), dt = to - from;
    if (!(dt > 0)) continue;
    const Eigen::Matrix3d R = (R_a * gyro.at(0.5 * (from + to))).toRotationMatrix();
    const double share = (0.5 * (from + to) - it->t) / (next->t - it->t);
    const Eigen::Vector3d f = (1 - share) * it->accel + share * next->accel;
    Matrix39 F;
    for (int i = 0; i < 3; ++i) F.block<3, 3>(0, 3 * i) = R.col(i) * f.transpose();
    out.p += dt * out.v + 0.5 * dt * dt * F;
    out.p_bias += dt * out.v_bias - 0.5 * dt * dt * R;
    out.v += dt * F;
    out.v_bias -= dt * R;
    const double push = dt * std::max(0.0, f.norm() - gravity), passed = (0.5 * (from + to) - a) / (b - a);
    out.past += push * push * passed * passed;
    out.left += push * push * (1 - passed) * (1 - passed);
    out.product += push * push * passed * (1 - passed);
  }
  return out;
}

// What the mean place during a sweep differs from that in its middle by, but for gravity; by element of the axes.
Matrix39 mean_shift(const std::vector<InertialSample>& imu, const GyroPath& gyro, const SweepPose& pose, double offset, const SO3& R_IL) {
  const double a = pose.begin + offset, b = pose.end + offset, span = b - a;
  if (!(span > 0.01) || !gyro.covers(a, b)) return Matrix39::Zero();
  const Eigen::Matrix3d R_WI = (pose.T_WL.R * R_IL.inverse()).matrix() * gyro.between(pose.t + offset, a).toRotationMatrix();
  return span / 24 * R_WI * integrate(imu, gyro, a, b).v;
}

struct Block {
  explicit Block(Eigen::Index n) : H(Eigen::MatrixXd::Zero(n, n)), g(Eigen::VectorXd::Zero(n)) {}
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};

}  // namespace

double TranslationFit::sigma_r(int i) const { return std::sqrt(std::max(0.0, cov(i, i))); }

TranslationRows::TranslationRows(const std::vector<SweepPose>& poses, const std::vector<InertialSample>& imu, const GyroPath& gyro,
                                 const SO3& R_IL, double offset) {
  const auto usable = [&](const SweepPose& p) { return p.good && p.weakest > weak; };
  std::size_t last = 0;
  for (std::size_t k = 1; k + 1 < poses.size(); ++k) {
    const SweepPose &a = poses[k - 1], &b = poses[k], &c = poses[k + 1];
    if (!usable(a) || !usable(b) || !usable(c)) continue;
    const double before = b.t - a.t, after = c.t - b.t;
    if (!(before > 0.02 && after > 0.02 && before < 0.35 && after < 0.35)) continue;
    if (!gyro.covers(a.t + offset, c.t + offset)) continue;
    const SO3 R_a = a.T_WL.R * R_IL.inverse(), R_b = b.T_WL.R * R_IL.inverse(), R_c = c.T_WL.R * R_IL.inverse();
    const Integral I = integrate(imu, gyro, a.t + offset, b.t + offset), J = integrate(imu, gyro, b.t + offset, c.t + offset);
    Row row;
    row.t = b.t;
    row.follows = !rows_.empty() && last + 1 == k;
    last = k;
    row.dt = 0.5 * (before + after);
    row.before = before;
    row.after = after;
    row.pushed = I.past + J.left;
    row.shared = I.product;
    row.y = (c.T_WL.p - b.T_WL.p) / after - (b.T_WL.p - a.T_WL.p) / before;
    row.H_r = (R_c.matrix() - R_b.matrix()) / after - (R_b.matrix() - R_a.matrix()) / before;
    row.H_ba = R_a.matrix() * (I.v_bias - I.p_bias / before) + R_b.matrix() * J.p_bias / after;
    row.force = R_a.matrix() * (I.v - I.p / before) + R_b.matrix() * J.p / after;
    // A sweep gives the mean of the way during it, which is off its middle by a T^2 / 24.
    const Matrix39 A = mean_shift(imu, gyro, a, offset, R_IL), B = mean_shift(imu, gyro, b, offset, R_IL),
                   C = mean_shift(imu, gyro, c, offset, R_IL);
    row.force += (C - B) / after - (B - A) / before;
    rows_.push_back(row);
  }
}

// One line for each component of a row, over the place, gravity, the accelerometer's bias and, where they are free, its axes.
struct TranslationRows::Equations {
  static constexpr int most = 18;
  std::vector<Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, most>> J;
  std::vector<Eigen::Vector3d> y;
  double log_scale = 0;  // mean logarithm of what the rows were divided by

  void subtract(std::size_t row, double times, std::size_t before) {
    J[row] -= times * J[row - before];
    y[row] -= times * y[row - before];
  }
};

TranslationRows::Equations TranslationRows::equations(const Eigen::Matrix3d& axes, bool free_axes) const {
  Vector9 elements;
  for (int i = 0; i < 3; ++i) elements.segment<3>(3 * i) = axes.row(i).transpose();
  Equations out;
  for (const Row& row : rows_) {
    auto& J = out.J.emplace_back(3, free_axes ? 18 : 9);
    J.leftCols<9>() << row.H_r, row.dt * Eigen::Matrix3d::Identity(), row.H_ba;
    if (free_axes) J.rightCols<9>() = row.force;
    out.y.emplace_back(row.y - row.force * elements);
  }
  return out;
}

// The rows without what each has in common with the two before it, divided by its own standard deviation: the noise of a sweep's place is
// in three of them, that of the acceleration in an interval in two. By the Cholesky factor of their covariance, which is a band.
TranslationRows::Equations TranslationRows::whitened(const Equations& of, const Noise& noise) const {
  Equations out = of;
  const double white = noise.accel * noise.accel, push = noise.push * noise.push;
  double own = 1, own_before = 1, with_last = 0;  // elements of the factor
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Row& row = rows_[i];
    const double a = 1 / row.before, b = 1 / row.after;
    const double variance = 2 * (a * a + b * b + a * b) + white * (row.before + row.after) / 3 + push * row.pushed;
    double covariance = 0, with_second = 0;
    if (row.follows) {
      const Row& last = rows_[i - 1];
      covariance = -a * (2 * a + b + 1 / last.before) + white * row.before / 6 + push * row.shared;
      if (last.follows) with_second = a / last.before / own_before;
    }
    with_last = (covariance - with_second * with_last) / own;
    if (row.follows) out.subtract(i, with_last, 1);
    if (with_second != 0) out.subtract(i, with_second, 2);
    own_before = own;
    own = std::sqrt(variance - with_last * with_last - with_second * with_second);
    out.J[i] /= own;
    out.y[i] /= own;
    out.log_scale += std::log(own) / static_cast<double>(rows_.size());
  }
  return out;
}

std::optional<TranslationRows::Solution> TranslationRows::solve(const Equations& of) const {
  const Eigen::Index n = of.J.front().cols();
  Eigen::VectorXd prior = Eigen::VectorXd::Zero(n);
  prior.head<3>().setConstant(1 / (position_prior * position_prior));
  prior.segment<3>(6).setConstant(1 / (accel_bias_prior * accel_bias_prior));
  if (n > 9) prior.tail<9>().setConstant(1 / (accel_axes_prior * accel_axes_prior));
  Solution out;
  out.x = Eigen::VectorXd::Zero(n);
  out.scale = 0.3;
  for (int k = 0; k < 8; ++k) {
    const double s2 = out.scale * out.scale;
    out.unlikely = 3 * std::log(out.scale);
    const Eigen::MatrixXd H_prior = s2 * Eigen::MatrixXd(prior.asDiagonal());
    std::vector<Block> blocks(1, Block(n));
    Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
    std::vector<double> lengths;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const Eigen::Vector3d e = of.y[i] - of.J[i] * out.x;
      lengths.push_back(e.squaredNorm());
      const double far = e.squaredNorm() / (freedom * s2), weight = 1 / (1 + far);
      out.unlikely += (freedom + 3) / 2 * std::log1p(far) / static_cast<double>(rows_.size());
      if (i > 0 && static_cast<int>(rows_[i - 1].t / block_seconds) != static_cast<int>(rows_[i].t / block_seconds)) blocks.emplace_back(n);
      blocks.back().H += weight * of.J[i].transpose().lazyProduct(of.J[i]);
      blocks.back().g += weight * of.J[i].transpose() * e;
      g += weight * of.J[i].transpose() * of.y[i];
    }
    Eigen::MatrixXd H = H_prior;
    for (const Block& b : blocks) H += b.H;
    const Eigen::MatrixXd inverse = H.ldlt().solve(Eigen::MatrixXd::Identity(n, n));
    if (k == 7) out.cov = s2 * inverse * H_prior * inverse + jackknife(blocks, H);
    out.x = inverse * g;
    const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
    std::ranges::nth_element(lengths, middle);
    out.scale = std::sqrt(*middle / 2.366) + 1e-6;
  }
  return out.x.allFinite() ? std::optional(out) : std::nullopt;
}

std::optional<TranslationFit> TranslationRows::fit(const Eigen::Matrix3d& axes) const {
  if (rows_.size() < fewest_rows) return std::nullopt;
  const auto found = solve(equations(axes, false));
  if (!found) return std::nullopt;
  return TranslationFit{found->x.head<3>(), found->x.segment<3>(3), found->x.tail<3>(), found->cov, found->scale, rows_.size()};
}

std::optional<TranslationFit> TranslationRows::refine(const Eigen::Matrix3d& axes) const {
  std::optional<TranslationFit> out = fit(axes);
  if (!out) return std::nullopt;
  const Equations with_axes = equations(axes, true);
  std::optional<Solution> best;
  // The most likely noise: an accelerometer errs by a share of what it measures beyond gravity, where impacts end its range or alias.
  for (const double push : {0.0, 25.0, 50.0, 100.0, 200.0, 400.0}) {
    for (const double accel : {1.0, 3.0, 10.0, 30.0, 100.0}) {
      const Equations rows = whitened(with_axes, {accel, push});
      std::optional<Solution> found = solve(rows);
      if (!found) continue;
      found->unlikely += 3 * rows.log_scale;
      if (!best || found->unlikely < best->unlikely) best = std::move(found);
    }
  }
  if (!best) return out;
  out->r = best->x.head<3>();
  out->cov.topRows<3>().setZero();
  out->cov.leftCols<3>().setZero();
  out->cov.topLeftCorner<3, 3>() = best->cov.topLeftCorner<3, 3>();
  return out;
}

WayScale TranslationRows::scale(const Eigen::Matrix3d& axes, const TranslationFit& from) const {
  constexpr Eigen::Index n = 10;  // the place, gravity and the bias again, and the factor
  Vector9 elements;
  for (int i = 0; i < 3; ++i) elements.segment<3>(3 * i) = axes.row(i).transpose();
  Eigen::VectorXd x(n);
  x << from.r, from.g_W, from.ba, 1;
  double moved = 0, left = 0;
  std::vector<Block> blocks;
  Eigen::MatrixXd H;
  for (int k = 0; k < 4; ++k) {
    blocks.assign(1, Block(n));
    moved = left = 0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const Row& row = rows_[i];
      Eigen::Matrix<double, 3, n> J;
      J << row.H_r, row.dt * Eigen::Matrix3d::Identity(), row.H_ba, row.force * elements;
      const Eigen::Vector3d e = row.y - J * x;
      const double weight = 1 / (1 + e.squaredNorm() / (12 * from.rms * from.rms));
      if (i > 0 && static_cast<int>(rows_[i - 1].t / block_seconds) != static_cast<int>(row.t / block_seconds)) blocks.emplace_back(n);
      blocks.back().H += weight * J.transpose() * J;
      blocks.back().g += weight * J.transpose() * e;
      moved += weight * (J.col(n - 1) + row.dt * from.g_W).squaredNorm();
      left += weight * e.squaredNorm();
    }
    H = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
    for (const Block& b : blocks) H += b.H, g += b.g;
    H.diagonal().array() += 1e-9;  // of what does not show
    x += H.ldlt().solve(g);
  }
  const double factor = x[n - 1];
  if (!(x.allFinite() && factor > 0 && moved > 0)) return {};
  // The slope of the other regression, of the acceleration on the way: factor / R^2 with R^2 = factor^2 moved / (factor^2 moved + left).
  return {factor, std::sqrt(jackknife(blocks, H)(n - 1, n - 1)), factor + left / (factor * moved)};
}

}  // namespace kilvo::lab
