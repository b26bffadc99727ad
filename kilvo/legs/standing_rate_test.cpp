#include "kilvo/legs/standing_rate.hpp"

#include <cmath>
#include <functional>
#include <gtest/gtest.h>

#include "tests/helpers/random.hpp"
#include "tests/helpers/synthetic_gait.hpp"

namespace kilvo {
namespace standing_rate_test {

// A robot that stands: the turn of its body and what of it each sole shows, as rotation vectors over time.
struct Stand {
  std::function<Eigen::Vector3d(double s)> body = [](double) { return Eigen::Vector3d::Zero(); };
  std::function<Eigen::Vector3d(std::size_t side, double s)> soles_turn = [](std::size_t, double) { return Eigen::Vector3d::Zero(); };
  double encoder_step = 0;  // rad
  double gyro_noise = 0;    // rad/s/sqrt(Hz)
  int corners = 4;
  Eigen::Vector3d bias = {0.002, -0.001, 0.003};
  double rate = 200;  // Hz
};

struct Known {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  double sigma = 0;
  int readings = 0;
};

// All readings of a stand together, as a filter takes them.
Known read(const Stand& stand, double duration, unsigned seed = 1) {
  StandingRate standing;
  Contacts contacts;
  test::Random random(seed);
  Known out;
  double information = 0;
  const auto count = static_cast<int>(duration * stand.rate);
  const double dt = 1 / stand.rate;
  for (int i = 0; i <= count; ++i) {
    const double s = dt * i;
    Feet feet;
    feet.t = test::gait_begin + from_seconds(s);
    for (std::size_t side = 0; side < 2; ++side) {
      Eigen::Vector3d seen = stand.body(s) - stand.soles_turn(side, s);
      if (stand.encoder_step > 0) seen = (seen / stand.encoder_step).array().round().matrix() * stand.encoder_step;
      feet.foot[side].R_IF = SO3::Exp(-seen);
      feet.foot[side].corners = stand.corners;
    }
    Eigen::Vector3d gyro = stand.bias;
    if (i > 0) gyro += (SO3::Exp(stand.body(s - dt)).inverse() * SO3::Exp(stand.body(s))).Log() / dt;
    for (int k = 0; k < 3; ++k) gyro[k] += random.normal(1) * stand.gyro_noise * std::sqrt(stand.rate);
    const auto reading = standing.add(feet, contacts, gyro);
    if (!reading) continue;
    const double weight = 1 / (reading->sigma * reading->sigma);
    out.bias = (information * out.bias + weight * reading->bias) / (information + weight);
    information += weight;
    ++out.readings;
  }
  out.sigma = information > 0 ? 1 / std::sqrt(information) : 0;
  return out;
}

TEST(StandingRate, WhatTheGyroSaysBeyondTheTurnOfBothSolesIsItsBias) {
  for (const Eigen::Vector3d& rate : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(2e-4, -3e-4, 4e-4)}) {
    Stand stand;
    stand.body = [rate](double s) -> Eigen::Vector3d { return s * rate; };
    const Known known = read(stand, 4);
    ASSERT_GT(known.readings, 0);
    EXPECT_LT((known.bias - stand.bias).norm(), 1e-6);
    EXPECT_LT(known.sigma, 2e-4 + rate.norm()) << "a turn may be hidden in part";
  }
  Stand turning;
  turning.body = [](double s) -> Eigen::Vector3d { return s * Eigen::Vector3d(0.05, -0.1, 0.2); };
  EXPECT_EQ(read(turning, 4).readings, 0) << "who turns is not at rest";
}

// As a real one does: it sways by 3 mrad, the encoders have steps of 1.5 mrad, and for a second after its walk the soles hide half of a
// turn.
Stand swaying() {
  Stand stand;
  stand.encoder_step = 1.5e-3;
  stand.gyro_noise = 2e-4;
  const auto settling = [](double s) { return 0.03 * std::exp(-s / 0.4); };
  stand.body = [settling](double s) -> Eigen::Vector3d {
    return Eigen::Vector3d(3e-3 * std::sin(7 * s), 3e-3 * std::sin(5 * s + 1), 1e-3 * std::sin(3 * s) + settling(s));
  };
  stand.soles_turn = [settling](std::size_t, double s) -> Eigen::Vector3d { return {0, 0, 0.5 * settling(s)}; };
  return stand;
}

TEST(StandingRate, SwayCoarseEncodersAndSettlingLeaveTheBiasAsWellKnownAsItSays) {
  double chi2 = 0;
  constexpr int seeds = 20;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    const Stand stand = swaying();
    const Known known = read(stand, 8, seed);
    ASSERT_GT(known.readings, 0);
    EXPECT_LT(known.sigma, 3e-4) << "0.02 degrees a second";
    chi2 += (known.bias - stand.bias).squaredNorm() / (3 * known.sigma * known.sigma * seeds);
  }
  EXPECT_LT(chi2, 2);
}

TEST(StandingRate, ALongerStandSaysMore) {
  const double two = read(swaying(), 3).sigma, four = read(swaying(), 6).sigma, eight = read(swaying(), 12).sigma;
  EXPECT_LT(four, 0.7 * two);
  EXPECT_LT(eight, 0.75 * four);
}

TEST(StandingRate, SolesThatDoNotAgreeSayLittle) {
  const auto with_right_sole = [](double rate) {
    Stand stand;
    stand.bias.setZero();
    stand.soles_turn = [rate](std::size_t side, double s) -> Eigen::Vector3d { return {0, 0, side == 1 ? rate * s : 0}; };
    return read(stand, 4);
  };
  EXPECT_EQ(with_right_sole(0.02).readings, 0);
  const Known known = with_right_sole(0.0012);
  ASSERT_GT(known.readings, 0);
  EXPECT_LT(known.bias.norm(), 3 * known.sigma);
  EXPECT_GT(known.sigma, 3e-4);
}

TEST(StandingRate, FeetThatArePointsSayNothingOfTheTurn) {
  Stand stand;
  stand.corners = 1;
  EXPECT_EQ(read(stand, 4).readings, 0);
}

}  // namespace standing_rate_test
}  // namespace kilvo
