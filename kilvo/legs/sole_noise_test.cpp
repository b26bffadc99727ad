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

// Both feet seem to rise from when the state has taken a push that did not happen: an error of the state, and no noise of the soles.
TEST(SoleNoise, SolesThatAllRiseShowAnErrorOfTheState) {
  test::Random random(3);
  const LegConfig config;
  SoleNoise noise(config);
  constexpr double dt = 0.005, wrong = 0.1, sigma_v = 0.008;
  const int samples = static_cast<int>(config.velocity_correlation / dt) + 1;
  const auto stance = [&](std::size_t side, double rise) {
    for (int i = 0; i < samples; ++i) {
      const Eigen::Vector3d seen = random.vector3(0.02) + rise * Eigen::Vector3d::UnitZ();
      noise.add(side, seen, Eigen::Vector3d::UnitZ(), dt, sigma_v);
    }
    noise.interrupt(side);
    return noise.take_rise();
  };
  for (std::size_t k = 0; k < 30; ++k) EXPECT_FALSE(stance(k % 2, 0));
  EXPECT_FALSE(stance(0, 2 * wrong)) << "one foot may do so of its own";
  EXPECT_FALSE(stance(0, wrong));
  EXPECT_FALSE(stance(1, 0));
  EXPECT_FALSE(stance(0, wrong));
  EXPECT_NEAR(stance(1, wrong).value_or(0), wrong, 0.01);
  EXPECT_FALSE(stance(0, wrong)) << "it takes both anew";
  EXPECT_LT(noise.vertical(), 2 * config.vertical_velocity_sigma);
}

}  // namespace
}  // namespace kilvo
