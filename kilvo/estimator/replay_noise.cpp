// The IMU's noise, estimated from the samples of the last seconds.
#include <algorithm>
#include <cmath>

#include "kilvo/estimator/replay.hpp"
#include "kilvo/filter/gap.hpp"

namespace kilvo {

void Replay::note_usual(const ImuSample& s) {
  if (imu_.empty()) {
    usual_.gyro_mean = s.gyro;
    usual_.accel_mean = s.accel;
    return;
  }
  constexpr double memory = 2.0;  // s
  const ImuSample& b = imu_.back();
  const double dt = to_seconds(s.t - b.t), share = std::min(1.0, dt / memory);
  const Eigen::Vector3d gyro = s.gyro - usual_.gyro_mean, accel = s.accel - usual_.accel_mean;
  usual_.gyro_mean += share * gyro;
  usual_.accel_mean += share * accel;
  usual_.gyro_variance += share * (gyro.cwiseAbs2() - usual_.gyro_variance);
  usual_.accel_variance += share * (accel.cwiseAbs2() - usual_.accel_variance);
  // Neither what is missed nor a pair that came together counts for more than half of a period.
  if (usual_.period == 0) usual_.period = dt;
  usual_.period += (std::clamp(dt, 0.5 * usual_.period, 1.5 * usual_.period) - usual_.period) / 64;
  if (imu_.size() < 2) return;
  const ImuSample& a = imu_[imu_.size() - 2];
  if (to_seconds(s.t - a.t) > periods_of_a_gap * usual_.period) return;
  const double part = to_seconds(b.t - a.t) / to_seconds(s.t - a.t);
  const double gyro2 = (b.gyro - a.gyro - part * (s.gyro - a.gyro)).squaredNorm() / 3;
  const double accel2 = (b.accel - a.accel - part * (s.accel - a.accel)).squaredNorm() / 3;
  usual_.gyro_bend2 = std::max(gyro2, (1 - share) * usual_.gyro_bend2);
  usual_.accel_bend2 = std::max(accel2, (1 - share) * usual_.accel_bend2);
  // Half of a second difference: of white noise it has one and a half times the variance.
  const double count = std::min(1.0, 4 * dt / memory);
  usual_.gyro_density2 += count * (2.0 / 3.0 * gyro2 * dt - usual_.gyro_density2);
  usual_.accel_density2 += count * (2.0 / 3.0 * accel2 * dt - usual_.accel_density2);
}

double Replay::longest_gap() const { return std::max(config_.max_imu_gap, periods_of_a_gap * usual_.period); }

double Replay::expected_density2() const {
  const ProcessNoise& noise = config_.noise;
  return noise.accel * noise.accel + 2 * noise.velocity * noise.velocity / (usual_.period * usual_.period);
}

// Motion faster than half of the IMU's rate is aliased. Where the noise exceeds the settings, a share of the excess stays in the
// integral, and where it is more than half a second of samples shows by chance, a part of that each second in a bias: samples that are in
// step with the robot's steps add up.
ProcessNoise Replay::noise_now() const {
  ProcessNoise noise = config_.noise;
  constexpr double gyro_share = 0.1, least_aliased_share = 0.4;
  const double aliased = std::sqrt(std::max(0.0, usual_.accel_density2 - expected_density2()));
  noise.accel = std::hypot(noise.accel, least_aliased_share * aliased);
  if (uses_learnt_noise()) noise.accel *= usual_.accel_scale;
  if (aliases()) noise.accel_bias = std::hypot(noise.accel_bias, least_aliased_share * least_aliased_share * aliased);
  noise.gyro = std::max(noise.gyro, gyro_share * std::sqrt(usual_.gyro_density2));
  return noise;
}

// R. K. Mehra, "On the identification of variances and adaptive Kalman filtering", 1970. The next samples take back impacts, but not
// vibration near a multiple of the rate, nor what an accelerometer misses that clips.
void Replay::learn_accel_noise(double normalised, bool open) {
  constexpr double sweeps = 5, largest_scale = 6;
  const double scale = usual_.accel_scale, shown = std::min(normalised / (uses_learnt_noise() ? 1 : scale * scale), sweeps);
  usual_.accel_scale = std::clamp(scale * std::sqrt(1 + (shown - 1) / sweeps), 1.0, largest_scale);
  usual_.open = open;
}

}  // namespace kilvo
