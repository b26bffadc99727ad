#include "kilvo/filter/stationarity.hpp"

#include <gtest/gtest.h>
#include <random>

namespace kilvo {
namespace {

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
    StationarityDetector detector(0.03, 0.4, 10);
    const auto samples = stream(moving, 150);
    for (int i = 0; i < 90; ++i) detector.add(samples[static_cast<std::size_t>(i)]);
    EXPECT_FALSE(detector.stands());
    for (int i = 90; i < 150; ++i) detector.add(samples[static_cast<std::size_t>(i)]);
    EXPECT_EQ(detector.stands(), !moving);
  }
}

}  // namespace
}  // namespace kilvo
