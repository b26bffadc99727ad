// The live propagator when the messages that it lives by are lost, late, twice there, or nonsense.
#include "kilvo/estimator/live_propagator.hpp"

#include <gtest/gtest.h>
#include <limits>

#include "kilvo/estimator/estimator.hpp"

namespace kilvo {
namespace live_propagator_test {

using std::chrono::milliseconds;

constexpr Time live_start{std::chrono::seconds(100)};
constexpr std::array<bool, sensor_count> imu_and_feet = {true, true, false, false};

// A robot that stands, its IMU at 200 Hz and its feet at 500 Hz; forked after two seconds.
class LiveStanding : public testing::Test {
 protected:
  LiveStanding() : robot_(with_feet()), kinematics_(robot_), estimator_(robot_, EstimatorConfig{}, imu_and_feet), live_(robot_, {}) {
    for (int ms = 0; ms <= 2000; ++ms) {
      if (ms % 5 == 0) estimator_.push(imu(ms));
      if (ms % 2 == 0) estimator_.push(joints(ms));
    }
    forked_ = estimator_.fork(live_);
  }
  void SetUp() override {
    ASSERT_TRUE(forked_);
    ASSERT_TRUE(has_legs(live_.output().modality));
    known_ms_ = static_cast<int>((live_.output().t - live_start) / milliseconds(1));
    play(known_ms_ + 1, 2100);
    ASSERT_EQ(live_.output().t, live_start + milliseconds(2100));
  }

  static Robot with_feet() {
    Robot robot;
    robot.legs.type = "feet";
    robot.legs.rate = 500;
    return robot;
  }
  static ImuSample imu(int ms) {
    // Not a byte like the one before: a sensor that repeats itself is frozen.
    const double noise = 1e-3 * std::sin(1.3 * ms);
    return {live_start + milliseconds(ms), {noise, -noise, noise}, {noise, noise, standard_gravity + noise}};
  }
  static JointSample joints(int ms) {
    JointSample s;
    s.t = live_start + milliseconds(ms);
    const double noise = 1e-5 * std::sin(1.7 * ms);
    s.position = {noise, 0.1, -0.8, noise, -0.1, -0.8};
    s.velocity.assign(6, 0);
    return s;
  }
  bool push_feet(int ms) { return live_.push(std::get<Feet>(kinematics_.feet(joints(ms)))); }
  void play(int from_ms, int until_ms) {
    for (int ms = from_ms; ms <= until_ms; ++ms) {
      if (ms % 5 == 0) live_.push(imu(ms));
      if (ms % 2 == 0) push_feet(ms);
    }
  }
  static void expect_same_output(const Output& a, const Output& b) {
    EXPECT_EQ(a.t, b.t);
    EXPECT_EQ(a.x.R.matrix(), b.x.R.matrix());
    EXPECT_TRUE(boxminus(a.x, b.x).tail<at::size - 3>().isZero(0));
    EXPECT_TRUE((a.P - b.P).isZero(0));
  }
  void expect_unchanged(const Output& before) { expect_same_output(live_.output(), before); }

  Robot robot_;
  LegKinematics kinematics_;
  Estimator estimator_;
  LivePropagator live_;
  bool forked_ = false;
  int known_ms_ = 0;
};

TEST_F(LiveStanding, LegsThatAreLostAreReportedAndTheImuGoesOn) {
  std::optional<int> first_output, lost;
  for (int ms = 2105; ms <= 2300; ms += 5) {
    const bool is_new = live_.push(imu(ms));
    if (is_new && !first_output) first_output = ms;
    if (is_new && !has_legs(live_.output().modality) && !lost) lost = ms;
    EXPECT_EQ(live_.output().t, live_start + milliseconds(is_new ? ms : 2100));
  }
  ASSERT_TRUE(first_output && lost);
  EXPECT_EQ(*first_output, 2105) << "two and a half periods of the legs are 5 ms";
  EXPECT_EQ(*lost, 2155) << "50 ms";
  EXPECT_EQ(live_.output().cause, Reason::legs_lost);
  EXPECT_FALSE(live_.output().contacts);
  const Output before = live_.output();
  EXPECT_FALSE(push_feet(2302)) << "how they come again, the estimator decides";
  expect_unchanged(before);
}

TEST_F(LiveStanding, LegsThatTrailTheImuAreNotMissedForThat) {
  live_.expect_legs_after(milliseconds(100));
  for (int ms = 2105; ms <= 2200; ms += 5) {
    EXPECT_FALSE(live_.push(imu(ms))) << ms;
  }
  EXPECT_TRUE(push_feet(2102)) << "100 ms behind the IMU";
  EXPECT_EQ(live_.output().t, live_start + milliseconds(2102));
  EXPECT_TRUE(has_legs(live_.output().modality));
}

TEST_F(LiveStanding, AcrossAGapOfTheImuNothingIsSaid) {
  const Output before = live_.output();
  EXPECT_FALSE(live_.push(imu(2100 + 105))) << "its clock may have jumped, or it was silent: the estimator finds out";
  expect_unchanged(before);
  EXPECT_FALSE(push_feet(2100 + 102)) << "without an IMU legs are no odometry";
  expect_unchanged(before);
  EXPECT_TRUE(live_.push(imu(2105))) << "and it goes on when it was only a wrong stamp";
}

TEST_F(LiveStanding, WhatIsLateOrTwiceThereChangesNothing) {
  const Output before = live_.output();
  for (const int ms : {2100, 2095, 2000}) EXPECT_FALSE(live_.push(imu(ms))) << ms;
  for (const int ms : {2100, 2098, 1000}) EXPECT_FALSE(push_feet(ms)) << ms;
  expect_unchanged(before);
  LivePropagator spoilt = live_;
  spoilt.push(imu(2100));
  spoilt.push(imu(2050));
  for (LivePropagator* p : {&spoilt, &live_}) {
    for (int ms = 2101; ms <= 2150; ++ms) {
      if (ms % 5 == 0) p->push(imu(ms));
      if (ms % 2 == 0) p->push(std::get<Feet>(kinematics_.feet(joints(ms))));
    }
  }
  expect_same_output(spoilt.output(), live_.output());
}

TEST_F(LiveStanding, SamplesThatAreNoNumbersAreIgnored) {
  const Output before = live_.output();
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e6}) {
    ImuSample s = imu(2105);
    s.accel.x() = bad;
    EXPECT_FALSE(live_.push(s)) << bad;
    s = imu(2105);
    s.gyro.z() = bad;
    EXPECT_FALSE(live_.push(s)) << bad;
  }
  expect_unchanged(before);
}

// Whatever made the state nonsense: it says nothing until the estimator, which throws such a state away, is forked again.
TEST_F(LiveStanding, AStateThatIsNotFiniteGoesNowhere) {
  Feet feet = std::get<Feet>(kinematics_.feet(joints(2102)));
  for (FootPose& foot : feet.foot) foot.p.fill(Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  const auto is_honest = [this](bool answered) { return !answered || is_finite({live_.output().t, live_.output().x, live_.output().P}); };
  EXPECT_TRUE(is_honest(live_.push(feet)));
  for (int ms = 2103; ms <= 2150; ++ms) {
    EXPECT_TRUE(ms % 5 != 0 || is_honest(live_.push(imu(ms)))) << ms;
    EXPECT_TRUE(ms % 2 != 0 || is_honest(push_feet(ms))) << ms;
  }
  ASSERT_TRUE(estimator_.fork(live_));
  play(known_ms_ + 1, 2150);
  EXPECT_EQ(live_.output().t, live_start + milliseconds(2150));
  EXPECT_TRUE(is_finite({live_.output().t, live_.output().x, live_.output().P}));
  EXPECT_LT(live_.output().x.p.norm(), 0.01);
}

}  // namespace live_propagator_test
}  // namespace kilvo
