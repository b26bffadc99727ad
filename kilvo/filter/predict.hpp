// State prediction over an IMU interval (paper, Eqs. 2 and 3).
#pragma once

#include <array>
#include <tuple>

#include "kilvo/filter/state.hpp"
#include "kilvo/math/field.hpp"
#include "kilvo/sensors/measurement.hpp"

namespace kilvo {

/// The IMU's measurement from `begin` to `end`: rate and specific force at both ends (equal when only the latest sample is known).
struct ImuInterval {
  Time begin{}, end{};
  Eigen::Vector3d gyro_begin, gyro_end;    // rad/s
  Eigen::Vector3d accel_begin, accel_end;  // m/s^2
  double more_gyro = 0, more_accel = 0;    // beyond ProcessNoise, squared densities: what was missed or clipped, (rad/s)^2 s, (m/s^2)^2 s
  double gyro_scale = 1, velocity_scale = 1;  // multiply all of the rate's variance, and that of ProcessNoise::velocity
  bool made_biases = false;                   // at rest, and the biases are the means of these very samples
  bool is_blind = false;                      // in a gap whose ends do not tell the motion: carry_blind

  /// The latest sample, held.
  static ImuInterval hold(const ImuSample& s, Time begin, Time end) { return {begin, end, s.gyro, s.gyro, s.accel, s.accel}; }
  /// Part [begin, end] of the straight line between two samples.
  static ImuInterval between(const ImuSample& a, const ImuSample& b, Time begin, Time end);
};

/// Densities of the process noise: the covariance gets the square times dt, so that one setting means one filter at any rate.
struct ProcessNoise {
  double gyro = 4e-4;            // rad/s/sqrt(Hz)
  double accel = 0.003;          // m/s^2/sqrt(Hz)
  double velocity = 8e-4;        // m/s/sqrt(Hz)
  double gyro_bias = 2e-5;       // rad/s/sqrt(s)
  double accel_bias = 7e-4;      // m/s^2/sqrt(s)
  double foot = 0.005;           // m/sqrt(s), of a stance foot, each axis of the foot frame
  double exposure = 0.05;        // 1/sqrt(s)
  double foot_vertical = 0.025;  // m/sqrt(s), of a stance foot against gravity

  static constexpr auto fields() {
    return std::tuple{
        Field{"gyro_noise", &ProcessNoise::gyro, "rad/s/sqrt(Hz)", "noise density of the gyro, aliased impacts included"},
        Field{"accel_noise", &ProcessNoise::accel, "m/s^2/sqrt(Hz)", "noise density of the accelerometer, aliased impacts included"},
        Field{"velocity_noise", &ProcessNoise::velocity, "m/s/sqrt(Hz)",
              "noise density of the integrated acceleration that does not accumulate: aliased impacts that the next samples take back"},
        Field{"gyro_bias_walk", &ProcessNoise::gyro_bias, "rad/s/sqrt(s)", "random walk of the gyro bias"},
        Field{"accel_bias_walk", &ProcessNoise::accel_bias, "m/s^2/sqrt(s)", "random walk of the accelerometer bias"},
        Field{"foot_noise", &ProcessNoise::foot, "m/sqrt(s)", "random walk of a stance foot"},
        Field{"foot_noise_vertical", &ProcessNoise::foot_vertical, "m/sqrt(s)", "the same along the vertical"},
        Field{"exposure_walk", &ProcessNoise::exposure, "1/sqrt(s)", "random walk of the relative inverse exposure"}};
  }
};

/// Of each foot: it stands. The contact position of one that does not is not in use.
using StandingFeet = std::array<bool, 2>;

/// How the error of R, p and v depends on all errors before.
using Transition = Eigen::Matrix<double, 9, at::size, Eigen::RowMajor>;

/// Moves the estimate from interval.begin to interval.end. `e.t` must be interval.begin and the interval not negative.
void carry(Estimate& e, const ImuInterval& interval, const StandingFeet& feet, const ProcessNoise& noise, Transition* kept = nullptr);

/// The mean alone.
State predict_mean(const State& x, const ImuInterval& interval);

}  // namespace kilvo
