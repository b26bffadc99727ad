// The unit and the scale of the gyro, by a sensor that turns with it.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "kilvo/math/running_statistics.hpp"
#include "lab/doctor/examination.hpp"

namespace kilvo::lab {

std::pair<double, double> gyro_scale(const std::vector<Turn>& turns, const GyroPath& gyro, const MountFit& fit) {
  // The sensor's rate = share of each axis * the gyro's - bias: a bias that was found with another scale is not right.
  using Vector = Eigen::Matrix<double, 6, 1>;
  using Matrix = Eigen::Matrix<double, 6, 6>;
  struct Block {
    Matrix H = Matrix::Zero();
    Vector g = Vector::Zero();
  };
  Vector x = (Vector() << 1, 1, 1, 0, 0, 0).finished();
  double scale = 0;  // robust standard deviation of a rate
  std::vector<Block> blocks;
  Matrix H;
  for (int k = 0; k < 4; ++k) {
    blocks.assign(1, {});
    std::vector<double> errors;
    double until = -1;
    for (const Turn& turn : turns) {
      const double a = turn.a + fit.offset, b = turn.b + fit.offset, dt = turn.b - turn.a;
      if (!gyro.covers(a, b)) continue;
      Eigen::Matrix<double, 3, 6> J;
      J << fit.R.inverse().matrix() * Eigen::Vector3d(log_of(gyro.between(a, b)) / dt).asDiagonal(), -Eigen::Matrix3d::Identity();
      const Eigen::Vector3d e = turn.theta[0] / dt - J * x;
      errors.push_back(e.norm());
      const double weight = k == 0 ? 1 : 1 / (1 + e.squaredNorm() / (4 * scale * scale));
      if (until >= 0 && static_cast<int>(until / block_seconds) != static_cast<int>(turn.a / block_seconds)) blocks.emplace_back();
      until = turn.a;
      blocks.back().H += weight * J.transpose() * J;
      blocks.back().g += weight * J.transpose() * e;
    }
    constexpr std::size_t fewest = 30;  // intervals
    if (errors.size() < fewest) return {1, INFINITY};
    const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
    std::ranges::nth_element(errors, middle);
    scale = *middle + 1e-6;
    H = 1e-9 * Matrix::Identity();
    Vector g = Vector::Zero();
    for (const Block& block : blocks) H += block.H, g += block.g;
    x += H.ldlt().solve(g);
  }
  // A unit is the same on all axes. One of them may seem to be off by as much for another reason: along a corridor sweeps show too little
  // of the rolling.
  constexpr double of_an_axis = 0.02;
  // An axis that hardly turns tells nothing, which the scatter alone does not show.
  const Matrix open = scale * scale * H.ldlt().solve(Matrix::Identity());
  const Eigen::Matrix3d C = (jackknife(blocks, H) + open).topLeftCorner<3, 3>() + of_an_axis * of_an_axis * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d inverse = C.diagonal().cwiseInverse(), weights = inverse / inverse.sum();
  const double share = weights.dot(x.head<3>()), sigma = std::sqrt(weights.dot(C * weights));
  return share > 0 ? std::pair{1 / share, sigma / (share * share)} : std::pair<double, double>{1, INFINITY};
}

// Of a walk that turns, degrees taken for radians turn by more than half a turn from sweep to sweep: as they are they agree with nothing.
void Examination::try_gyro_in_degrees() {
  if (lidar_.known || lidar_turns_.empty()) return;
  const Eigen::Matrix3d before = gyro_axes_;
  gyro_axes_ = before / degrees(1);
  const SenseAgreement in_degrees = agreement(lidar_turns_, robot_.lidar.T_imu_lidar.R, 0.8);
  if (!in_degrees.known) {
    gyro_axes_ = before;
    return;
  }
  lidar_ = in_degrees;
  accuse_gyro_in_degrees(fmt::format("the LiDAR's sweeps explain {:.0f} % of its turning then", 100 * in_degrees.explained));
}

void Examination::accuse_gyro_in_degrees(const std::string& evidence) {
  find({Sensor::imu,
        "gyro_unit",
        "the gyro is in degrees per second, not in rad/s",
        evidence,
        "the driver must publish rad/s",
        degrees(1),
        "",
        {},
        true});
}

// A gyro of a robot is within a percent; sweeps show it to a thousandth.
void Examination::examine_gyro_scale(const std::vector<Turn>& turns, const MountFit& fit) {
  const auto [scale, sigma] = gyro_scale(turns, gyro(), fit);
  // Sweeps that are taken as measured at once turn by a tenth too much or too little.
  const double tolerance = recorded_.reading.without_deskew ? 0.2 : 0.04;
  if (std::abs(scale - 1) < std::max(tolerance, sure * sigma)) return;
  // Wrong times of the points make sweeps turn by too much or too little; taken as measured at once they do not.
  if (point_times_are_undecided_) {
    const double rigid = gyro_scale(turns_of(scan_odometry(recorded_.sweeps, {})), gyro(), fit).first;
    if (std::abs(rigid - 1) < tolerance || (rigid > 1) != (scale > 1)) return;
  }
  gyro_axes_ /= scale;
  gyro_bias_ /= scale;
  find({Sensor::imu,
        "gyro_unit",
        fmt::format("the gyro measures {:.3f} times the turning", scale),
        fmt::format("turning by the gyro through that of the LiDAR's sweeps: {:.3f}, standard deviation {:.3f}", scale, sigma),
        "the driver must publish rad/s: the scale of its gyro is wrong",
        scale,
        "",
        {},
        true});
}

// On legs and IMU alone the heading is off by this share of each turn: nothing else measures it.
void Examination::refine_gyro_scale(const MountFit& fit) {
  constexpr double method = 1e-3, largest = 3e-3;  // what the fit is off by beyond its sigma on rough walks; beyond which it is unknown
  const Eigen::Vector3d x = -fit.gyro_excess, s = fit.gyro_excess_sigma;
  Refinement r = refinement(Sensor::imu, "scale of the gyro's axes", {x.x(), x.y(), x.z()}, {s.x(), s.y(), s.z()}, method, largest, "-");
  const Eigen::Vector3d scale = original_.imu.gyro_scale.cwiseProduct(Eigen::Vector3d::Ones() + r.taken_vector());
  r.changes = {{"imu.gyro_scale", fmt::format("[{:.5f}, {:.5f}, {:.5f}]", scale.x(), scale.y(), scale.z())}};
  refinements_.push_back(std::move(r));
  examine_gyro_axes(x, s);
}

// One axis of it: a factor of the driver, a sensor that is broken.
void Examination::examine_gyro_axes(const Eigen::Vector3d& change, const Eigen::Vector3d& sigma) {
  constexpr double tolerance = 0.03;
  Eigen::Index worst = 0;
  const double most = change.cwiseAbs().maxCoeff(&worst);
  if (most < std::max(tolerance, sure * sigma[worst]) ||
      std::ranges::any_of(diagnosis_.findings, [](const Finding& f) { return f.cause == "gyro_unit"; }))
    return;
  Eigen::Vector3d factor = Eigen::Vector3d::Ones();
  factor[worst] += change[worst];
  const bool own_axes = gyro_axes_.isApprox(Eigen::Matrix3d::Identity(), 1e-9);  // as imu.gyro_scale has them
  gyro_axes_ = (factor.asDiagonal() * gyro_axes_).eval();
  gyro_bias_ = factor.cwiseProduct(gyro_bias_);
  find({Sensor::imu,
        "gyro_unit",
        fmt::format("the gyro measures {:.3f} times the turning about its {}", 1 / factor[worst], "xyz"[worst]),
        fmt::format("turning by the LiDAR's sweeps through that of the gyro: {:.3f}, standard deviation {:.3f}", factor[worst],
                    sigma[worst]),
        "imu.gyro_scale, or the scale of the driver",
        1 / factor[worst],
        "",
        {},
        true});
  if (own_axes) diagnosis_.findings.back().changes = {{"imu.gyro_scale", vector_text(original_.imu.gyro_scale.cwiseProduct(factor))}};
}

// s, of stepping.
double Examination::walked_between(double a, double b) const {
  const Stepping stepping = stepping_of(legs_under(nullptr));
  return stepping.walks() ? std::max(0.0, std::min(b, stepping.end) - std::max(a, stepping.begin)) : 0;
}

// Noise alone changes each sample of a gyro. One that fails on the way repeats what it measured last; one with a dead band has repeated
// itself before.
// Gyro or accelerometer. A half of an IMU that works does not repeat itself while the robot walks.
void Examination::examine_frozen_axes(Eigen::Vector3d InertialSample::*half) {
  const std::vector<InertialSample>& imu = recorded_.imu;
  if (imu.empty()) return;
  constexpr double no_chance = 5, rest = 0.2;  // s, for which a sensor that works does not repeat itself while the robot walks, or at all
  std::string axes;
  std::size_t since = 0;  // sample
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const std::size_t last = imu.size() - 1;
    const auto first_of_run = [&](std::size_t from) {
      while (from > 0 && (imu[from - 1].*half)[axis] == (imu[from].*half)[axis]) --from;
      return from;
    };
    const std::size_t from = first_of_run(last);
    bool has_dead_band = false;
    for (std::size_t k = from; k > 0 && !has_dead_band; k = first_of_run(k - 1))
      has_dead_band = imu[k - 1].t - imu[first_of_run(k - 1)].t > rest;
    if (from > 0 && (has_dead_band || walked_between(imu[from].t, imu[last].t) < no_chance)) continue;
    axes += (axes.empty() ? "" : ", ") + std::string(1, "xyz"[axis]);
    since = std::max(since, from);
  }
  if (axes.empty()) return;
  // A sensor with a dead band may well be silent at rest.
  const bool is_gyro = half == &InertialSample::gyro;
  RunningStatistics other(0, 0, 0, INFINITY);
  for (std::size_t k = since; k < imu.size(); ++k) other.add((is_gyro ? imu[k].accel : imu[k].gyro).norm(), 1);
  constexpr double walks = 0.5, turns = 0.05;  // m/s^2, rad/s: standard deviations
  if (other.sigma() < (is_gyro ? walks : turns)) return;
  const std::string name = is_gyro ? "gyro" : "accelerometer", along = is_gyro ? "about " : "along ";
  find({Sensor::imu,
        is_gyro ? "gyro_frozen" : "accel_frozen",
        since == 0 ? fmt::format("the {} never changes {}{}", name, along, axes)
                   : fmt::format("the {} has not changed {}{} for the last {:.0f} s", name, along, axes, imu.back().t - imu[since].t),
        fmt::format("{} samples are the same, while the {} has a standard deviation of {:.2f} {}", imu.size() - since,
                    is_gyro ? "acceleration" : "turning", other.sigma(), is_gyro ? "m/s^2" : "rad/s"),
        fmt::format("the driver must publish what the {} measures", name),
        0,
        "",
        {},
        true});
}

}  // namespace kilvo::lab
