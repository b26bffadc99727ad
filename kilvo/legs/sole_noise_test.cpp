#include "kilvo/legs/sole_noise.hpp"

#include <gtest/gtest.h>

#include "tests/helpers/random.hpp"

namespace kilvo {
namespace {

TEST(SoleNoise, LearnsWhatStaysAfterAveragingOverTheCorrelationTime) {
  test::Random random(1);
  const LegConfig config;
  SoleNoise noise(config);
  constexpr double dt = 0.005, slide = 0.06;
  const int samples = static_cast<int>(config.velocity_correlation / dt) + 1;
  for (int stance = 0; stance < 200; ++stance) {
    const Eigen::Vector3d mean = random.vector3(slide);
    for (int i = 0; i < samples; ++i) noise.add(0, mean + random.vector3(0.05), Eigen::Vector3d::UnitZ(), dt);
    noise.interrupt(0);
  }
  // Twice, for what the state follows and what is alike at all steps.
  EXPECT_NEAR(noise.horizontal(), 2 * slide, 0.8 * slide);
  EXPECT_NEAR(noise.vertical(), 2 * slide, 1.0 * slide);
}

TEST(SoleNoise, IsNeverLessThanTheSettingsSay) {
  const LegConfig config;
  SoleNoise noise(config);
  for (int i = 0; i < 100000; ++i) noise.add(1, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ(), 0.001);
  EXPECT_EQ(noise.horizontal(), config.velocity_sigma);
  EXPECT_EQ(noise.vertical(), config.vertical_velocity_sigma);
}

}  // namespace
}  // namespace kilvo
