#include "kilvo/legs/standing_rate.hpp"

#include <gtest/gtest.h>

#include "tests/helpers/synthetic_gait.hpp"

namespace kilvo {
namespace {

// A body that turns by `rate` over two soles, of which the right one may turn on the ground.
std::optional<GyroBiasReading> read(const Eigen::Vector3d& rate, const Eigen::Vector3d& bias, double right_turns, int corners = 4) {
  StandingRate standing;
  Contacts contacts;
  for (int i = 0; i <= 520; ++i) {
    const double s = 1e-3 * i;
    const SO3 R_WI = SO3::Exp(s * rate);
    Feet feet;
    feet.t = test::gait_begin + from_seconds(s);
    for (std::size_t side = 0; side < 2; ++side) {
      feet.foot[side].R_IF = R_WI.inverse() * SO3::Exp({0, 0, side == 1 ? right_turns * s : 0});
      feet.foot[side].corners = corners;
    }
    if (const auto out = standing.add(feet, contacts, rate + bias)) return out;
  }
  return std::nullopt;
}

TEST(StandingRate, WhatTheGyroSaysBeyondTheTurnOfBothSolesIsItsBias) {
  const Eigen::Vector3d bias(0.002, -0.001, 0.003);
  for (const Eigen::Vector3d& rate : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(2e-4, -3e-4, 4e-4)}) {
    const auto reading = read(rate, bias, 0);
    ASSERT_TRUE(reading);
    EXPECT_LT((reading->bias - bias).norm(), 1e-9);
    EXPECT_LT(reading->sigma, 5e-4 + rate.norm()) << "a turn may be hidden in part";
  }
  EXPECT_FALSE(read({0.05, -0.1, 0.2}, bias, 0)) << "who turns is not at rest";
}

TEST(StandingRate, SolesThatDoNotAgreeSayLittle) {
  EXPECT_FALSE(read(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0.02));
  const auto reading = read(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0.0012);
  ASSERT_TRUE(reading);
  EXPECT_LT(reading->bias.norm(), 3 * reading->sigma);
  EXPECT_GT(reading->sigma, 5e-4);
}

TEST(StandingRate, FeetThatArePointsSayNothingOfTheTurn) { EXPECT_FALSE(read({0, 0, 0}, Eigen::Vector3d::Zero(), 0, 1)); }

}  // namespace
}  // namespace kilvo
