#include "kilvo/estimator/imu_watch.hpp"

#include <algorithm>

#include "kilvo/filter/update.hpp"

namespace kilvo {
namespace {

// Of each axis of an accelerometer for robots, m/s^2; on all three at once it is the square root of three times as much.
constexpr double usual_range = 16 * standard_gravity;

}  // namespace

ImuWatch::ImuWatch(const ImuMount& mount, const InitialConfig& config)
    : absurd_accel_(1.8 * std::max(mount.accel_range, usual_range)),
      clipping_(mount.gyro_range, mount.accel_range),
      velocity_sigma_(config.velocity_sigma),
      stationarity_(config.still_gyro, config.still_accel) {}

std::optional<Reason> ImuWatch::prepare(ImuSample& s) {
  s.accel *= accel_scale_;
  // No IMU for robots measures it.
  if (s.accel.norm() > absurd_accel_) return Reason::absurd_value;
  clipping_.mark(s);
  return std::nullopt;
}

std::optional<Estimate> ImuWatch::zero_velocity_update(const Estimate& e, const ImuSample& s, const UpdateConfig& config) {
  constexpr Duration period = std::chrono::milliseconds(100);
  constexpr double accel_sigma = 0.2;  // m/s^2
  if (!stationarity_.stands() || (last_update_ && s.t - *last_update_ < period)) return std::nullopt;
  last_update_ = s.t;
  const auto at_rest = [&](const State& x, const Covariance&) {
    const Eigen::Vector3d down_I = x.R.inverse() * x.g;
    Rows<6> rows;
    rows.r.resize(6);
    rows.r << x.v, x.ba - down_I - s.accel;
    rows.H.setZero(6, at::size);
    rows.H.block<3, 3>(0, at::v).setIdentity();
    rows.H.block<3, 3>(3, at::R) = -skew(down_I);
    rows.H.block<3, 3>(3, at::ba).setIdentity();
    rows.H.block<3, 3>(3, at::g) = -x.R.matrix().transpose();
    rows.R.setZero(6, 6);
    rows.R.diagonal().head<3>().array() = velocity_sigma_ * velocity_sigma_;
    rows.R.diagonal().tail<3>().array() = accel_sigma * accel_sigma;
    return rows;
  };
  return update(e, at_rest, config).posterior;
}

}  // namespace kilvo
