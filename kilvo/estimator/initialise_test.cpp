#include "kilvo/estimator/initialise.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

namespace kilvo {
namespace initialise_test {

// Feeds a constant sample (plus `shake` on the gyro) at 200 Hz until there is a start; gives up after `patience` seconds.
std::optional<Start> start_from(const Eigen::Vector3d& gyro, const Eigen::Vector3d& accel, double shake = 0, double patience = 5,
                                bool align = true) {
  Initialiser initialiser(InitialConfig{}, align, ProcessNoise{}.accel);
  for (int i = 0; i < 200 * patience; ++i) {
    ImuSample s;
    s.t = time_from_ns(0) + Duration(5'000'000LL * i);
    s.gyro = gyro + Eigen::Vector3d(shake * std::sin(0.3 * i), 0, 0);
    s.accel = accel;
    if (auto start = initialiser.add(s)) return start;
  }
  return std::nullopt;
}

TEST(Level, KeepsTheHeadingOfAnUprightImu) {
  const SO3 R = level({0, 0, 1});
  EXPECT_LT((R.matrix() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
}

TEST(Level, AnImuThatHangsUpsideDownStartsWithARollOfHalfATurn) {
  const SO3 R = level({0, 0, -1});
  EXPECT_LT((R.matrix() - Eigen::Vector3d(1, -1, -1).asDiagonal().toDenseMatrix()).norm(), 1e-12);
}

TEST(Level, PutsXOfTheWorldAlongTheHorizontalPartOfX) {
  const SO3 R = level(Eigen::Vector3d(0.3, -0.2, 0.9));
  const Eigen::Vector3d x_W = R * Eigen::Vector3d::UnitX();
  EXPECT_NEAR(x_W.y(), 0, 1e-12);
  EXPECT_GT(x_W.x(), 0);
  EXPECT_LT((R * Eigen::Vector3d(0.3, -0.2, 0.9).normalized() - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
}

TEST(Level, TakesTheYAxisWhenXIsVertical) {
  const SO3 R = level(Eigen::Vector3d(1, 0.05, 0.05));
  const Eigen::Vector3d y_W = R * Eigen::Vector3d::UnitY();
  EXPECT_NEAR(y_W.y(), 0, 1e-12);
  EXPECT_GT(y_W.x(), 0.9);
}

TEST(Initialiser, StartsAtTheFirstSampleOfHalfASecondAtRest) {
  const auto start = start_from({0.002, -0.001, 0.003}, {0, 0, 9.9});
  ASSERT_TRUE(start);
  EXPECT_TRUE(start->still);
  EXPECT_EQ(start->estimate.t, time_from_ns(0));
  EXPECT_LT((start->estimate.x.bg - Eigen::Vector3d(0.002, -0.001, 0.003)).norm(), 1e-12);
  EXPECT_NEAR(start->estimate.x.ba.z(), 9.9 - standard_gravity, 1e-12) << "the resting norm is bias, not scale";
  EXPECT_EQ(start->accel_scale, 1.0);
}

TEST(Initialiser, StartsWithAnImuOf20Hz) {
  Initialiser initialiser(InitialConfig{}, true, ProcessNoise{}.accel);
  std::optional<Start> start;
  for (int i = 0; i < 40 && !start; ++i)
    start = initialiser.add({.t = time_from_ns(0) + i * Duration(50'000'000), .gyro = {0.001, 0, 0}, .accel = {0, 0, 9.8}});
  ASSERT_TRUE(start);
  EXPECT_TRUE(start->still);
}

// 2 degrees a second is not unusual for a gyro, and what its axes take for turning while gravity pulls comes on top.
TEST(Initialiser, StandsStillWithAGyroWhoseBiasIsLarge) {
  const Eigen::Vector3d bias(0.03, -0.04, 0.02);
  const auto start = start_from(bias, {0, 0, 9.8});
  ASSERT_TRUE(start);
  EXPECT_TRUE(start->still);
  EXPECT_LT((start->estimate.x.bg - bias).norm(), 1e-12);
}

TEST(Initialiser, DoesNotTakeAnEvenTurnForABias) {
  const Eigen::Vector3d rate(0.05, 0.02, 0);
  Initialiser initialiser(InitialConfig{}, true, ProcessNoise{}.accel);
  std::optional<Start> start;
  for (int i = 0; i < 1000 && !start; ++i) {
    ImuSample s;
    s.t = time_from_ns(0) + Duration(5'000'000LL * i);
    s.gyro = rate;
    s.accel = SO3::Exp(0.005 * i * rate).inverse() * Eigen::Vector3d(0, 0, 9.8);
    start = initialiser.add(s);
  }
  ASSERT_TRUE(start);
  EXPECT_FALSE(start->still);
}

TEST(Initialiser, DoesNotTakeComingToAStandForRest) {
  // It sets off to the side for 0.2 s by 0.3 m/s^2 and stands then: 6 cm/s, in a deviation of 0.15 m/s^2.
  Initialiser initialiser(InitialConfig{}, true, ProcessNoise{}.accel);
  std::optional<Start> start;
  for (int i = 0; i < 1000 && !start; ++i) {
    const Eigen::Vector3d accel(i < 40 ? 0.3 : 0.0, 0, 9.8);
    start = initialiser.add({time_from_ns(0) + Duration(5'000'000LL * i), Eigen::Vector3d::Zero(), accel});
  }
  ASSERT_TRUE(start);
  EXPECT_TRUE(start->still);
  EXPECT_GT(start->estimate.t, time_from_ns(50'000'000)) << "what is left of it is 4 cm/s";
}

TEST(Initialiser, DetectsAnAccelerometerInG) {
  const auto start = start_from(Eigen::Vector3d::Zero(), {0, 0, -1.01});
  ASSERT_TRUE(start);
  EXPECT_EQ(start->accel_scale, standard_gravity);
  EXPECT_NEAR(start->estimate.x.ba.norm(), 0.01 * standard_gravity, 1e-9);
}

TEST(Initialiser, AtRestTheTiltOfGravityAndTheAccelerometerBiasAreOneUnknown) {
  const auto start = start_from(Eigen::Vector3d::Zero(), {0, 0, 9.80665});
  ASSERT_TRUE(start);
  const Covariance& P = start->estimate.P;
  EXPECT_NEAR(P(at::g, at::g), 0.05 * 0.05, 1e-9);
  const double own = ProcessNoise{}.accel / std::sqrt(InitialConfig{}.still_time);  // of the mean, which is the bias's alone
  EXPECT_NEAR(P(at::ba, at::g) / std::sqrt(P(at::ba, at::ba) * P(at::g, at::g)), 0.05 / std::hypot(0.05, own), 1e-4);
  EXPECT_LT(P(at::g + 2, at::g + 2), 1e-9) << "its length is known";
  EXPECT_EQ(Eigen::LLT<Covariance>(P).info(), Eigen::Success);
  EXPECT_LT(P(at::R, at::R), 1e-9) << "the world is fixed by the first pose";
}

TEST(Initialiser, RefusesMotionAndThenStartsMovingWithWideUncertainties) {
  EXPECT_FALSE(start_from(Eigen::Vector3d::Zero(), {0, 0, 9.8}, 0.5, 2.9));
  const auto start = start_from(Eigen::Vector3d::Zero(), {0, 0, 9.8}, 0.5);
  ASSERT_TRUE(start);
  EXPECT_FALSE(start->still);
  EXPECT_GE(start->estimate.t, time_from_ns(2'990'000'000));
  EXPECT_GE(start->estimate.P(at::v, at::v), 1.0);
}

// It sways by 10 degrees and steps with 3 m/s^2, turning all the while: at the last sample it knows where up is all the same.
TEST(Initialiser, OnTheMoveGravityIsWhatIsLeftWhenTheMotionHasCancelled) {
  Initialiser initialiser(InitialConfig{}, false, ProcessNoise{}.accel);
  const auto attitude = [](double s) {
    return SO3::Exp({0, 0, 0.4 * s}) * SO3::Exp(Eigen::Vector3d(0.17 * std::sin(6 * s), 0.1 * std::cos(12 * s), 0));
  };
  std::optional<Start> start;
  double s = 0;
  for (; !start && s < 5; s += 0.005) {
    ImuSample sample;
    sample.t = time_from_ns(0) + from_seconds(s);
    sample.gyro = (attitude(s - 1e-4).inverse() * attitude(s + 1e-4)).Log() / 2e-4;
    sample.accel =
        attitude(s).inverse() * Eigen::Vector3d(3 * std::sin(12 * s), 1.5 * std::cos(6 * s), standard_gravity + 3 * std::cos(12 * s));
    start = initialiser.add(sample);
  }
  ASSERT_TRUE(start);
  ASSERT_FALSE(start->still);
  const Eigen::Vector3d up_I = attitude(s - 0.005).inverse() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d found_I = -(start->estimate.x.R.inverse() * start->estimate.x.g).normalized();
  EXPECT_LT(std::acos(up_I.dot(found_I)), 0.5 * std::numbers::pi / 180);
  const Eigen::Matrix3d P = start->estimate.P.block<3, 3>(at::g, at::g);
  EXPECT_GT(P.trace(), 2 * 0.2 * 0.2) << "it may have been setting off";
}

TEST(Initialiser, WithoutGravityAlignmentTheWorldIsTheFirstImuFrame) {
  const auto start = start_from(Eigen::Vector3d::Zero(), {0, 5.0, 8.4}, 0, 5, false);
  ASSERT_TRUE(start);
  EXPECT_LT((start->estimate.x.R.matrix() - Eigen::Matrix3d::Identity()).norm(), 1e-15);
  EXPECT_NEAR(start->estimate.x.g.norm(), standard_gravity, 1e-12);
  EXPECT_LT(start->estimate.x.g.y(), -4.9);
}

TEST(Initialiser, SaysWhatItWaitsFor) {
  const Initialiser initialiser(InitialConfig{}, true, ProcessNoise{}.accel);
  EXPECT_NE(initialiser.waiting_for().find("first IMU sample"), std::string::npos);
}

}  // namespace initialise_test
}  // namespace kilvo
