// Whether the gyro is of another unit, by how a sensor turned.
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "lab/doctor/turns.hpp"

namespace kilvo::lab {
namespace gyro_scale_test {

constexpr double seconds = 10, interval = 0.1;

// A walk: it rolls by much, pitches and yaws by less.
Eigen::Vector3d rate(double t) { return {0.4 * std::sin(9 * t), 0.2 * std::sin(7 * t + 1), 0.2 * std::sin(5 * t + 2)}; }

// By a gyro of these scales, and a sensor that is on the IMU's axes.
std::pair<double, double> measured(const Eigen::Vector3d& of_gyro, const Eigen::Vector3d& turning = Eigen::Vector3d::Ones()) {
  std::vector<InertialSample> samples, truth;
  for (double t = -0.2; t < seconds + 0.2; t += 0.005) {
    samples.push_back({t, of_gyro.cwiseProduct(turning.cwiseProduct(rate(t))), Eigen::Vector3d(0, 0, 9.81)});
    truth.push_back({t, turning.cwiseProduct(rate(t)), Eigen::Vector3d(0, 0, 9.81)});
  }
  const GyroPath gyro(samples, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()),
      turned(truth, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 5e-4);  // rad
  std::vector<Turn> turns;
  for (int i = 0; i * interval < seconds; ++i) {
    const double a = i * interval, b = a + interval;
    const Eigen::Vector3d off(noise(random), noise(random), noise(random));
    turns.push_back({a, b, {log_of(turned.between(a, b)) + off, Eigen::Vector3d::Zero()}});
  }
  return gyro_scale(turns, gyro, MountFit{});
}

TEST(GyroScale, OfAllAxesIsMeasuredAndSure) {
  for (const double factor : {0.9, 1.0, 1.1}) {
    const auto [scale, sigma] = measured(Eigen::Vector3d::Constant(factor));
    EXPECT_NEAR(scale, factor, 0.005);
    EXPECT_LT(sigma, 0.02);
  }
}

TEST(GyroScale, OfARobotThatTurnsAboutOneAxisOnlyIsThatOfTheAxis) {
  const auto [scale, sigma] = measured(Eigen::Vector3d::Constant(1.1), {0, 0, 1});
  EXPECT_NEAR(scale, 1.1, 0.01);
  EXPECT_LT(sigma, 0.03);
}

// Four standard deviations are asked for before it is accused.
TEST(GyroScale, OfTheAxisThatItTurnsAboutMostIsNotThatOfAll) {
  const auto [scale, sigma] = measured({1.066, 1, 1});
  EXPECT_LT(std::abs(scale - 1), 4 * sigma);
}

}  // namespace gyro_scale_test
}  // namespace kilvo::lab
