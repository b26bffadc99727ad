#include "kilvo/input/health.hpp"

#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <string_view>

namespace kilvo {
namespace health_test {

using std::chrono::milliseconds;

// Two hundred IMU samples a second with noise; `moving` adds a rate that swings.
class Stream {
 public:
  explicit Stream(bool moving) : moving_(moving) {}
  ImuSample next() {
    ImuSample s;
    s.t = Time(milliseconds(5 * ++n_));
    const double swing = moving_ ? 0.5 * std::sin(0.2 * static_cast<double>(n_)) : 0.0;
    s.gyro = {swing + noise_(random_), noise_(random_), noise_(random_)};
    s.accel = {noise_(random_), noise_(random_), 9.8 + noise_(random_)};
    return s;
  }

 private:
  bool moving_;
  std::int64_t n_ = 0;
  std::mt19937_64 random_{1};
  std::normal_distribution<double> noise_{0, 0.003};
};

JointSample legs_at(Time t) { return {t, {}, {0.1, 0.2, 0.3}, {0, 0, 0}, {}}; }

TEST(Health, AFrozenImuIsSaidWithin20SamplesAndIsAliveWhenItSpeaksAgain) {
  Health health{Robot{}};
  Stream stream(true);
  ImuSample last;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(health.judge(last = stream.next()), std::nullopt);
  int used = 0;
  for (int i = 0; i < 20; ++i) {
    last.t += milliseconds(5);
    used += health.judge(last) ? 0 : 1;
  }
  EXPECT_LE(used, 1);
  EXPECT_TRUE(health.is_frozen(Sensor::imu));
  ImuSample alive = stream.next();
  alive.t = last.t + milliseconds(5);
  EXPECT_EQ(health.judge(alive), std::nullopt);
  EXPECT_FALSE(health.is_frozen(Sensor::imu));
}

// As some accelerometers do when their driver loses them.
TEST(Health, HalfAnImuIsFrozenWhileTheOtherHalfGoesOn) {
  for (const bool accel : {true, false}) {
    Health health{Robot{}};
    Stream stream(true);
    ImuSample last;
    for (int i = 0; i < 100 || last.gyro.norm() < 0.3; ++i) EXPECT_EQ(health.judge(last = stream.next()), std::nullopt);
    int used = 0;
    for (int i = 0; i < 40; ++i) {
      ImuSample s = stream.next();
      (accel ? s.accel : s.gyro) = accel ? last.accel : last.gyro;
      used += health.judge(s) ? 0 : 1;
    }
    EXPECT_LE(used, 10) << accel;
    EXPECT_TRUE(health.is_frozen(Sensor::imu)) << accel;
    EXPECT_EQ(health.judge(stream.next()), std::nullopt);
    EXPECT_FALSE(health.is_frozen(Sensor::imu));
  }
}

TEST(Health, AGyroWithADeadBandIsNotFrozenWhereTheRobotStands) {
  Health health{Robot{}};
  Stream moving(true);
  Time t{};
  for (int i = 0; i < 200; ++i) {
    const ImuSample s = moving.next();
    EXPECT_EQ(health.judge(s), std::nullopt);
    t = s.t;
  }
  Stream still(false);
  for (int i = 0; i < 400; ++i) {
    ImuSample s = still.next();
    s.t = t += milliseconds(5);
    s.gyro.setZero();
    EXPECT_EQ(health.judge(s), std::nullopt) << i;
  }
}

// Of coarse steps, and of one axis that alone turns.
TEST(Health, AnAccelerometerThatRepeatsItselfAtRestIsNotFrozen) {
  Health health{Robot{}};
  Stream still(false);
  for (int i = 0; i < 400; ++i) {
    ImuSample s = still.next();
    if (i > 100) s.accel = {0, 0, 9.8};
    EXPECT_EQ(health.judge(s), std::nullopt) << i;
  }
}

// An accelerometer that is read half as often as the gyro says each value twice.
TEST(Health, AnAccelerometerOfHalfTheRateIsNotFrozen) {
  Health health{Robot{}};
  Stream stream(true);
  Eigen::Vector3d held = Eigen::Vector3d::Zero();
  for (int i = 0; i < 500; ++i) {
    ImuSample s = stream.next();
    if (i % 2 == 0) held = s.accel;
    s.accel = held;
    EXPECT_EQ(health.judge(s), std::nullopt);
  }
}

TEST(Health, AnImuWithoutNoiseIsNotFrozen) {
  Health health{Robot{}};
  ImuSample s;
  for (int i = 0; i < 500; ++i) {
    s.t += milliseconds(5);
    EXPECT_EQ(health.judge(s), std::nullopt);
  }
}

// Of a sensor that repeats itself while points of it are lost on the way, and then no more: no sweep after the first is used.
TEST(Health, AFrozenLidarIsFrozenWhicheverPointsAreBlank) {
  Health health{Robot{}};
  LidarScan scan;
  for (int i = 0; i < 3000; ++i) scan.points.push_back({1.0F + 0.001F * static_cast<float>(i), 2, 1, 10, 0});
  EXPECT_EQ(health.judge(scan), std::nullopt);
  for (int n = 1; n < 9; ++n) {
    LidarScan cut = scan;
    cut.t += milliseconds(100 * n);
    for (std::size_t i = 0; i < cut.points.size() && n >= 4; i += 2) cut.points[i].x = std::numeric_limits<float>::quiet_NaN();
    EXPECT_NE(health.judge(cut), std::nullopt) << n;
  }
  EXPECT_TRUE(health.is_frozen(Sensor::lidar));
  scan.t += milliseconds(1000);
  for (LidarPoint& p : scan.points) p.x += 0.01F;
  EXPECT_EQ(health.judge(scan), std::nullopt);
  EXPECT_FALSE(health.is_frozen(Sensor::lidar));
}

TEST(Health, LegsThatSayTheSameAreFrozenOnlyWhileTheImuMoves) {
  for (const bool moving : {false, true}) {
    Health health{Robot{}};
    Stream stream(moving);
    for (int i = 0; i < 400; ++i) {
      const ImuSample s = stream.next();
      EXPECT_EQ(health.judge(s), std::nullopt);
      for (int k = 1; k < 5; ++k) health.judge(legs_at(s.t + milliseconds(k)));
    }
    EXPECT_EQ(health.is_frozen(Sensor::legs), moving);
  }
}

TEST(Health, SilenceOfTheImuIsCountedByTheOthersStampsAndNotByTheirAbsence) {
  Health health{Robot{}};
  Stream stream(true);
  for (int i = 0; i < 100; ++i) health.judge(stream.next());
  // The legs come for the first time, long after: no silence.
  health.judge(legs_at(Time(milliseconds(2500))));
  EXPECT_EQ(health.imu_silence(), 0);
  health.judge(legs_at(Time(milliseconds(2650))));
  EXPECT_NEAR(health.imu_silence(), 0.15, 1e-9);
}

}  // namespace health_test
}  // namespace kilvo
