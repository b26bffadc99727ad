#include "kilvo/estimator/initialise.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kilvo/filter/stationarity.hpp"
#include "kilvo/input/reorder_buffer.hpp"

namespace kilvo {
namespace {

struct Statistics3 {
  Eigen::Vector3d mean, sigma;
};

template <class Member>
Statistics3 statistics_of(const std::deque<ImuSample>& window, Member member) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), squares = Eigen::Vector3d::Zero();
  for (const ImuSample& s : window) sum += s.*member;
  const Eigen::Vector3d mean = sum / static_cast<double>(window.size());
  for (const ImuSample& s : window) squares += (s.*member - mean).cwiseAbs2();
  return {mean, (squares / static_cast<double>(window.size())).cwiseSqrt()};
}

// The resting norm is near 1: the unit is g. Rescaling to the exact norm would hide the bias, so only the unit is changed.
double unit_of(double resting_norm) { return std::abs(resting_norm - 1.0) < 0.1 ? standard_gravity : 1.0; }

// How far the velocity leaves its mean's line, m/s: a robot that stops within the window changes the standard deviation little.
double largest_change_of_velocity(const std::deque<ImuSample>& window, const Eigen::Vector3d& mean_accel) {
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  double largest = 0;
  for (std::size_t i = 1; i < window.size(); ++i) {
    v += to_seconds(window[i].t - window[i - 1].t) * (0.5 * (window[i].accel + window[i - 1].accel) - mean_accel);
    largest = std::max(largest, v.norm());
  }
  return largest;
}

// The mean specific force of a robot that moves, in the frame of the last sample: each is turned there by the gyro. Weighted by a bell over
// the window, so that swaying and stepping, which return to where they began, leave nothing.
Eigen::Vector3d mean_force(const std::deque<ImuSample>& window) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weights = 0;
  SO3 R;  // from the sample's frame to that of the last one
  for (std::size_t i = window.size(); i-- > 0;) {
    if (i + 1 < window.size()) {
      const double dt = to_seconds(window[i + 1].t - window[i].t);
      R = R * SO3::Exp(-0.5 * dt * (window[i].gyro + window[i + 1].gyro));
    }
    const double weight = 1 - std::cos(2 * std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(window.size()));
    sum += weight * (R * window[i].accel);
    weights += weight;
  }
  return sum / weights;
}

// What is known exactly still gets this much, so that the covariance stays positive definite: 10 micrometres, 10 microradians.
constexpr double floor_variance = 1e-10;

}  // namespace

SO3 level(const Eigen::Vector3d& up_I) {
  const Eigen::Vector3d z = up_I.normalized();
  const bool x_is_vertical = std::abs(z.x()) > std::cos(10.0 * std::numbers::pi / 180.0);
  const Eigen::Vector3d forward = x_is_vertical ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
  const Eigen::Vector3d x = (forward - forward.dot(z) * z).normalized();
  Eigen::Matrix3d R;
  R.row(0) = x;
  R.row(1) = z.cross(x);
  R.row(2) = z;
  return SO3::nearest(R);
}

std::string Initialiser::waiting_for() const {
  if (window_.empty()) return "waiting for the first IMU sample";
  return "waiting for the robot to stand still for " + std::to_string(config_.still_time) + " s";
}

std::optional<Start> Initialiser::add(const ImuSample& s) {
  if (!first_) first_ = s.t;
  window_.push_back(s);
  moving_.push_back(s);
  while (s.t - moving_.front().t > from_seconds(config_.moving_start)) moving_.pop_front();
  // The shortest run of samples that spans still_time, and is long enough for a slow IMU.
  constexpr std::size_t min_samples = 20;
  while (window_.size() > min_samples && s.t - window_[1].t >= from_seconds(config_.still_time)) window_.pop_front();
  if (s.t - window_.front().t < from_seconds(config_.still_time) || window_.size() < min_samples) return std::nullopt;

  const auto gyro = statistics_of(window_, &ImuSample::gyro);
  const auto accel = statistics_of(window_, &ImuSample::accel);
  const double unit = unit_of(accel.mean.norm());
  // A slow sway has a small deviation and is no rest: its rate would be taken for the bias. It shows as a change within the window.
  constexpr double largest_change = 0.004;  // rad/s
  const auto middle = window_.begin() + static_cast<std::ptrdiff_t>(window_.size() / 2);
  const std::deque<ImuSample> older(window_.begin(), middle), newer(middle, window_.end());
  const Eigen::Vector3d change = statistics_of(newer, &ImuSample::gyro).mean - statistics_of(older, &ImuSample::gyro).mean;
  // A mean that is more than most biases is one if gravity does not turn by it.
  const Eigen::Vector3d by_motion = -0.5 * config_.still_time * gyro.mean.cross(accel.mean);
  const Eigen::Vector3d turned = statistics_of(newer, &ImuSample::accel).mean - statistics_of(older, &ImuSample::accel).mean;
  const double noise = accel.sigma.norm() * std::sqrt(4.0 / static_cast<double>(window_.size()));
  const bool gravity_stays = by_motion.norm() < 3 * noise || turned.dot(by_motion) < 0.5 * by_motion.squaredNorm();
  const bool is_bias = gyro.mean.norm() < largest_resting_rate || (gyro.mean.norm() < largest_gyro_bias && gravity_stays);
  const bool still = gyro.sigma.maxCoeff() < config_.still_gyro && is_bias && change.cwiseAbs().maxCoeff() < largest_change &&
                     accel.sigma.maxCoeff() * unit < config_.still_accel &&
                     largest_change_of_velocity(window_, accel.mean) * unit < config_.velocity_sigma;
  if (still) return start(true);
  if (s.t - *first_ >= from_seconds(config_.moving_start)) return start(false);
  return std::nullopt;
}

Start Initialiser::start(bool still) const {
  const Eigen::Vector3d gyro = statistics_of(window_, &ImuSample::gyro).mean;
  Eigen::Vector3d accel = still ? statistics_of(window_, &ImuSample::accel).mean : mean_force(moving_);
  Start out;
  out.still = still;
  out.resting_norm = accel.norm();
  out.accel_scale = unit_of(accel.norm());
  accel *= out.accel_scale;
  const Eigen::Vector3d up_I = accel.norm() > 1e-6 ? Eigen::Vector3d(accel.normalized()) : Eigen::Vector3d::UnitZ();

  Estimate& e = out.estimate;
  if (still) out.rest_until = window_.back().t;
  e.t = still ? window_.front().t : window_.back().t;
  if (gravity_align_) e.x.R = level(up_I);
  const Eigen::Vector3d up_W = e.x.R * up_I;
  e.x.g = -standard_gravity * up_W;

  // The world is fixed by the first pose. Gravity carries the tilt: two directions, and at rest the accelerometer bias turns with it.
  constexpr double moving_tilt = 0.4;  // m/s^2: the change of velocity of a robot that starts to walk
  const double tilt = still ? config_.gravity_sigma : moving_tilt;
  const Eigen::Matrix3d horizontal = Eigen::Matrix3d::Identity() - up_W * up_W.transpose();
  const Eigen::Matrix3d gravity = tilt * tilt * horizontal;
  const Eigen::Matrix3d Rt = e.x.R.matrix().transpose();
  e.P.setZero();
  e.P.diagonal().setConstant(floor_variance);
  e.P.block<3, 3>(at::g, at::g) += gravity;
  if (still) {
    e.x.bg = gyro;
    e.x.ba = (accel.norm() - standard_gravity) * up_I;
    constexpr double unknown_gravity = 0.02;  // m/s^2, how much gravity differs between places
    // The mean at rest is bias less gravity, but for its own noise.
    const double mean_variance = accel_noise_ * accel_noise_ / config_.still_time;
    e.P.block<3, 3>(at::ba, at::ba) += Rt * gravity * Rt.transpose() + unknown_gravity * unknown_gravity * up_I * up_I.transpose() +
                                       mean_variance * Eigen::Matrix3d::Identity();
    e.P.block<3, 3>(at::ba, at::g) = Rt * gravity;
    e.P.block<3, 3>(at::g, at::ba) = gravity * Rt.transpose();
    e.P.diagonal().segment<3>(at::bg).array() += config_.gyro_bias_sigma * config_.gyro_bias_sigma;
    e.P.diagonal().segment<3>(at::v).array() += config_.velocity_sigma * config_.velocity_sigma;
  } else {
    e.P.diagonal().segment<3>(at::ba).array() += 0.1 * 0.1;
    e.P.diagonal().segment<3>(at::bg).array() += 0.02 * 0.02;
    e.P.diagonal().segment<3>(at::v).array() += 1.0;
  }
  return out;
}

std::optional<Start> Starter::add(Measurement m) {
  std::optional<Start> start;
  if (const auto* imu = std::get_if<ImuSample>(&m)) start = initialiser_.add(*imu);
  kept_.push_back(std::move(m));
  bound_images();
  // A moving start looks this far back and no farther.
  const Time oldest = completion_of(kept_.back()) - from_seconds(moving_start_ + 1.0);
  while (completion_of(kept_.front()) < oldest) {
    dropped_.push_back(sensor_of(kept_.front()));
    kept_.pop_front();
  }
  return start;
}

// Images are large, and only those of the still window will be of use.
void Starter::bound_images() {
  const auto* image = std::get_if<CameraImage>(&kept_.back());
  if (image == nullptr) return;
  const auto is_old = [oldest = image->t - 2 * still_time_](const Measurement& m) {
    return std::holds_alternative<CameraImage>(m) && stamp_of(m) < oldest;
  };
  dropped_.insert(dropped_.end(), std::erase_if(kept_, is_old), Sensor::camera);
}

}  // namespace kilvo
