#include "kilvo/legs/sole_noise.hpp"

#include <gtest/gtest.h>

#include "tests/helpers/random.hpp"

namespace kilvo {
namespace sole_noise_test {

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
  const auto stand_still = [&noise](std::optional<double> sigma_v) {
    for (int i = 0; i < 100000; ++i)
      noise.add(static_cast<std::size_t>(i / 500 % 2), Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ(), 0.001, sigma_v);
  };
  stand_still(0.01);
  EXPECT_EQ(noise.horizontal(), config.velocity_sigma);
  EXPECT_EQ(noise.vertical(), config.vertical_velocity_sigma) << "the legs alone do not show how soles settle";
  stand_still(std::nullopt);
  EXPECT_EQ(noise.vertical(), config.velocity_sigma) << "beside a LiDAR they did not settle";
  stand_still(0.01);
  EXPECT_EQ(noise.vertical(), config.velocity_sigma) << "and do so as little once it is lost";
}

// Stances of both feet by turns, 0.5 s each with noise of their own; what the soles then show.
class Stances {
 public:
  std::optional<double> stand(std::size_t side, double rise) {
    for (int i = 0; i < static_cast<int>(config_.velocity_correlation / dt) + 1; ++i) {
      const Eigen::Vector3d seen = random_.vector3(0.02) + rise * Eigen::Vector3d::UnitZ();
      noise.add(side, seen, Eigen::Vector3d::UnitZ(), dt, sigma_v);
    }
    noise.interrupt(side);
    return noise.take_rise();
  }
  // How many of so many stances show an error of the state.
  int walk(int stances, double rise, double own) {
    int shown = 0;
    for (int k = 0; k < stances; ++k) shown += stand(static_cast<std::size_t>(k % 2), rise + random_.vector3(own).z()).has_value();
    return shown;
  }
  static constexpr double dt = 0.005, sigma_v = 0.008;

 private:
  LegConfig config_;
  test::Random random_{3};

 public:
  SoleNoise noise{config_};
};

// Both feet seem to rise from when the state has taken a push that did not happen: an error of the state, and no noise of the soles.
TEST(SoleNoise, TwoSolesThatBothRiseByMuchShowAnErrorOfTheStateAtOnce) {
  Stances stances;
  constexpr double wrong = 0.1;
  EXPECT_EQ(stances.walk(30, 0, 0), 0);
  EXPECT_FALSE(stances.stand(0, wrong));  // it differs from the stance before, which is noise
  const double noise = stances.noise.vertical();
  EXPECT_NEAR(stances.stand(1, wrong).value_or(0), wrong, 0.2 * wrong);
  EXPECT_LE(stances.noise.vertical(), noise) << "it is no noise";
}

TEST(SoleNoise, OneSoleThatRisesIsNoErrorOfTheState) {
  Stances stances;
  stances.walk(30, 0, 0);
  EXPECT_FALSE(stances.stand(0, 0.2));
  EXPECT_FALSE(stances.stand(1, 0));
  EXPECT_FALSE(stances.stand(0, 0));
}

// Less than the noise of a stance is seen by what many stances have in common (Mehra 1970).
TEST(SoleNoise, WhatManyStancesHaveInCommonIsAnErrorOfTheState) {
  Stances alike, own;
  EXPECT_GE(alike.walk(60, 0.04, 0.03), 40);
  EXPECT_LE(own.walk(60, 0, 0.03), 15);
  EXPECT_NEAR(alike.noise.vertical(), 0.03, 0.015);
  EXPECT_NEAR(own.noise.vertical(), 0.03, 0.015);
}

}  // namespace sole_noise_test
}  // namespace kilvo
