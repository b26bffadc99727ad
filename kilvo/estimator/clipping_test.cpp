#include "kilvo/estimator/clipping.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

namespace kilvo {
namespace clipping_test {

// Steps of a walk: bells of `peak` m/s^2 beside gravity, no two alike, with noise; cut at `range`.
int marked(ClippingDetector& detector, double peak, double range, int& clipped) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0, 0.05);
  int found = 0;
  for (int i = 0; i < 6000; ++i) {
    const double phase = (i % 100) / 100.0, step = peak * (1 + 0.2 * std::sin(0.37 * (i / 100)));
    ImuSample s;
    s.accel = {noise(random), noise(random), 9.8 + step * std::exp(-std::pow((phase - 0.3) / 0.02, 2)) + noise(random)};
    s.gyro = {0.5 * std::sin(0.01 * i) + 0.01 * noise(random), noise(random), noise(random)};
    const bool cut = s.accel.z() > range;
    clipped += cut ? 1 : 0;
    s.accel = s.accel.cwiseMin(range).cwiseMax(-range);
    detector.mark(s);
    EXPECT_FALSE(s.gyro_clipped);
    EXPECT_FALSE(s.accel_clipped && !cut) << i;
    found += s.accel_clipped ? 1 : 0;
  }
  return found;
}

TEST(Clipping, OfARangeThatNobodyGaveIsFoundButForTheFirst) {
  for (const double range : {22.0, 31.3, 40.0}) {
    ClippingDetector detector(0, 0);
    int clipped = 0;
    const int found = marked(detector, 35, range, clipped);
    EXPECT_GT(clipped, 20) << range;
    EXPECT_GE(found, clipped - 1) << range;
  }
}

TEST(Clipping, AtAUsualRangeIsFoundAtTheFirstSample) {
  ImuSample s;
  s.accel = {0.3, -29.4, 4};
  ClippingDetector(0, 0).mark(s);
  EXPECT_TRUE(s.accel_clipped);
  EXPECT_FALSE(s.gyro_clipped);
  s.accel = {0, 0, 9.8};
  s.gyro = {0, 250 * M_PI / 180, 0};
  ClippingDetector(0, 0).mark(s);
  EXPECT_TRUE(s.gyro_clipped);
  EXPECT_FALSE(s.accel_clipped);
}

TEST(Clipping, OfAGivenRangeIsFoundAtOnceAndNowhereElse) {
  ClippingDetector detector(0, 20);
  int clipped = 0;
  EXPECT_EQ(marked(detector, 35, 20, clipped), clipped);
}

TEST(Clipping, IsNotFoundWhereNothingIsCut) {
  ClippingDetector detector(0, 0);
  int clipped = 0;
  EXPECT_EQ(marked(detector, 35, 1e3, clipped), 0);
}

// A torso that turns to and fro, by a gyroscope with steps of 16 bits: its largest rate comes again and again.
TEST(Clipping, IsNotFoundWhereAMotionTurnsRound) {
  constexpr double step = 2000 * M_PI / 180 / 32768;
  ClippingDetector detector(0, 0);
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0, 2e-3);
  for (int i = 0; i < 6000; ++i) {
    ImuSample s;
    s.accel = {0, 0, 9.81};
    s.gyro = {0, 0, step * std::round((2.7 * std::sin(2 * M_PI * 0.6 * i / 200.0) + noise(random)) / step)};
    detector.mark(s);
    EXPECT_FALSE(s.gyro_clipped) << i;
  }
}

TEST(Clipping, IsNotFoundAtRest) {
  ClippingDetector detector(0, 0);
  for (int i = 0; i < 100; ++i) {
    ImuSample s;
    s.accel = {0, 0, 9.81};
    detector.mark(s);
    EXPECT_FALSE(s.accel_clipped);
  }
}

}  // namespace clipping_test
}  // namespace kilvo
