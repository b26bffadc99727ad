#include "kilvo/filter/stationarity.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace kilvo {
namespace stationarity_test {

Time time_at(double s) { return Time(from_seconds(s)); }

// At 200 Hz, of a robot that stands or sways.
std::vector<ImuSample> stream(bool moving, int count) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 1);
  std::vector<ImuSample> out;
  for (int i = 0; i < count; ++i) {
    ImuSample s;
    s.t = Time(std::chrono::milliseconds(5 * i));
    const double swing = moving ? std::sin(0.05 * i) : 0;
    s.gyro = {0.3 * swing + 1e-3 * noise(random), 1e-3 * noise(random), 1e-3 * noise(random)};
    s.accel = {2 * swing + 0.02 * noise(random), 0.02 * noise(random), 9.81 + 0.02 * noise(random)};
    out.push_back(s);
  }
  return out;
}

TEST(StationarityDetector, StandsAfterHalfASecondOfRestAndNotInMotion) {
  for (const bool moving : {false, true}) {
    StationarityDetector detector(0.03, 0.4);
    const auto samples = stream(moving, 150);
    for (int i = 0; i < 90; ++i) detector.add(samples[static_cast<std::size_t>(i)], Eigen::Vector3d::Zero());
    EXPECT_FALSE(detector.stands());
    for (int i = 90; i < 150; ++i) detector.add(samples[static_cast<std::size_t>(i)], Eigen::Vector3d::Zero());
    EXPECT_EQ(detector.stands(), !moving);
  }
}

TEST(StationarityDetector, AKnownGyroBiasIsNoMotionAndAnUnknownOneIs) {
  const Eigen::Vector3d bias(0.03, -0.04, 0);
  for (const bool known : {false, true}) {
    StationarityDetector detector(0.03, 0.4);
    for (ImuSample s : stream(false, 150)) {
      s.gyro += bias;
      detector.add(s, known ? bias : Eigen::Vector3d::Zero());
    }
    EXPECT_EQ(detector.stands(), known);
  }
}

TEST(StationarityDetector, TakesAnImpactForUnusualAndForgetsIt) {
  StationarityDetector detector(0.03, 0.4);
  ImuSample s;
  const auto add = [&](int i, double z) {
    s.t = time_at(0.005 * i);
    s.accel = {0.1 * std::sin(0.9 * i), 0.1 * std::cos(1.3 * i), z + 0.2 * std::sin(0.5 * i)};
    detector.add(s, Eigen::Vector3d::Zero());
  };
  for (int i = 0; i < 600; ++i) add(i, 9.8);
  EXPECT_TRUE(detector.is_usual(s.t, std::chrono::milliseconds(20)));
  add(600, 40);
  EXPECT_FALSE(detector.is_usual(s.t, std::chrono::milliseconds(20)));
  for (int i = 601; i < 610; ++i) add(i, 9.8);
  EXPECT_TRUE(detector.is_usual(s.t, std::chrono::milliseconds(20)));
}

// Samples that are ten seconds apart: what is usual is then the last of them.
TEST(UsualAcceleration, StaysFiniteAfterALongGap) {
  UsualAcceleration usual;
  usual.deviation({0, 0, 9.8}, 0.005);
  for (int i = 0; i < 20; ++i) {
    const double deviation = usual.deviation({0, i % 2 == 0 ? 3.0 : -3.0, 9.8}, 10);
    EXPECT_TRUE(std::isfinite(deviation)) << i;
    EXPECT_GE(deviation, 0) << i;
  }
}

}  // namespace stationarity_test
}  // namespace kilvo
