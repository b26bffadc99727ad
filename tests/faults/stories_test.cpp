// What each failure does to a walking robot's estimate.
#include <cstdio>
#include <cstdlib>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <memory>

#include "tests/faults/failing_walk.hpp"

namespace kilvo {
namespace stories_test {

using lab::Failure;
using lab::FailureKind;
using test::FailingWalk;
using test::Moment;
using test::Outcome;

constexpr double for_ever = std::numeric_limits<double>::infinity();

class Faults : public testing::Test {
 protected:
  static void SetUpTestSuite() { walk_ = std::make_unique<FailingWalk>("room", 1, 14); }
  static void TearDownTestSuite() { walk_.reset(); }

  static Outcome with(std::vector<Failure> failures) {
    Outcome out = walk_->with(std::move(failures));
    EXPECT_TRUE(out.finite);
    EXPECT_TRUE(out.ordered);
    return out;
  }
  static void say(const char* what, const Outcome& o, double from, double until) {
    std::printf("%-22s", what);
    for (const std::string& c : o.changes()) std::printf(" %s", c.c_str());
    std::printf(
        "  error %.4f m, %.1f sigmas (at %.2f s), sigma %.3f m, rotation %.1f sigmas (at %.2f s); at the end %.4f m; searched %d found %d "
        "anew %d\n",
        o.worst(&Moment::error, from, until), o.worst(&Moment::sigmas, from, until), o.when_worst(&Moment::sigmas, from, until),
        o.worst(&Moment::sigma, from, until), o.worst(&Moment::tilt_sigmas, from, until), o.when_worst(&Moment::tilt_sigmas, from, until),
        o.moments.back().error, static_cast<int>(o.statistics.searches), static_cast<int>(o.statistics.found),
        static_cast<int>(o.statistics.maps_begun_anew));
  }

  static std::unique_ptr<FailingWalk> walk_;
};
std::unique_ptr<FailingWalk> Faults::walk_;

TEST_F(Faults, NothingWrongIsNothingSaid) {
  const Outcome o = with({});
  say("nothing", o, 0, 20);
  EXPECT_LT(o.worst(&Moment::error, 0, 20), 0.006);
  EXPECT_EQ(o.statistics.imu_outages, 0u);
  EXPECT_EQ(o.statistics.searches, 0u);
  for (const StreamHealth& h : o.statistics.health) {
    EXPECT_EQ(h.frozen, 0u);
    EXPECT_EQ(h.off_clock, 0u);
    EXPECT_EQ(h.clipped, 0u);
  }
  EXPECT_THAT(warnings_of(o.statistics), testing::IsEmpty());
}

TEST_F(Faults, AnImuThatIsSilentInMidWalkIsSaidAndOutlived) {
  for (const double length : {0.12, 0.3, 0.6, 1.5}) {
    const Outcome o = with({{FailureKind::drop, Sensor::imu, 6, 6 + length}});
    say(("imu " + std::to_string(length)).c_str(), o, 6, 14);
    EXPECT_TRUE(o.has_cause(Reason::imu_lost));
    EXPECT_TRUE(o.has_cause(Reason::imu_back));
    EXPECT_LT(o.worst(&Moment::sigmas, 5, 14), 4.0);
    EXPECT_LT(o.moments.back().error, 0.006);
    for (const Moment& m : o.moments) EXPECT_FALSE(m.s > 6.11 && m.s < 6 + length) << m.s;
  }
}

TEST_F(Faults, WithoutLidarAnImuThatWasSilentLeavesAnHonestEstimate) {
  const Outcome o = with({{FailureKind::drop, Sensor::lidar, 0, for_ever}, {FailureKind::drop, Sensor::imu, 6, 7.5}});
  say("imu 1.5, legs only", o, 6, 14);
  EXPECT_LT(o.worst(&Moment::sigmas, 5, 14), 4.0);
}

TEST_F(Faults, AnImuHalfOfWhichIsFrozenIsAFrozenImu) {
  for (const double gyro : {0.0, 1.0}) {
    const Outcome o = with({{FailureKind::freeze_half, Sensor::imu, 6, 6.5, gyro}});
    say(gyro > 0 ? "gyro frozen 0.5" : "accelerometer frozen 0.5", o, 6, 14);
    EXPECT_LT(o.worst(&Moment::sigmas, 5, 14), 3.5);
    EXPECT_LT(o.worst(&Moment::error, 9, 14), 0.009);
  }
}

TEST_F(Faults, AllButTheImuLostForTwoSeconds) {
  const Outcome o = with({{FailureKind::drop, Sensor::lidar, 6, 8}, {FailureKind::drop, Sensor::legs, 6, 8}});
  say("coast 2 s", o, 6, 8.1);
  EXPECT_EQ(o.modality_at(7), Modality::coast);
  EXPECT_EQ(o.modality_at(9), Modality::kil);
  EXPECT_LT(o.worst(&Moment::sigmas, 5, 14), 3.5);
  EXPECT_LT(o.worst(&Moment::error, 9, 14), 0.009);
}

TEST_F(Faults, OneSensorLostForSixSeconds) {
  const Outcome legs = with({{FailureKind::drop, Sensor::legs, 6, 12}});
  say("legs 6 s", legs, 6, 14);
  EXPECT_THAT(legs.changes(), testing::ElementsAre("KIL", "LI", "KIL"));
  EXPECT_LT(legs.worst(&Moment::error, 6, 14), 0.009);
  const Outcome lidar = with({{FailureKind::drop, Sensor::lidar, 6, 12}});
  say("lidar 6 s", lidar, 6, 14);
  EXPECT_THAT(lidar.changes(), testing::ElementsAre("KIL", "KI", "KIL"));
  EXPECT_LT(lidar.worst(&Moment::error, 6, 14), 0.015);
}

TEST_F(Faults, FrozenSensorsAreLost) {
  const Outcome legs = with({{FailureKind::freeze, Sensor::legs, 6, 8}});
  say("legs frozen", legs, 6, 14);
  EXPECT_TRUE(legs.has_cause(Reason::legs_frozen));
  EXPECT_LT(legs.worst(&Moment::error, 6, 14), 0.006);
  const Outcome lidar = with({{FailureKind::freeze, Sensor::lidar, 6, 8}});
  say("lidar frozen", lidar, 6, 14);
  EXPECT_TRUE(lidar.has_cause(Reason::lidar_frozen));
  EXPECT_LT(lidar.worst(&Moment::error, 6, 14), 0.012);
  const Outcome imu = with({{FailureKind::freeze, Sensor::imu, 6, 7}});
  say("imu frozen", imu, 6, 14);
  EXPECT_TRUE(imu.has_cause(Reason::imu_frozen));
  EXPECT_LT(imu.worst(&Moment::sigmas, 6, 14), 4.0);
}

// A spike that a body could hardly do but an IMU can say: half a degree and more, within one sample.
TEST_F(Faults, OneWrongSampleOfTheImuIsOutlived) {
  for (const double amount : {3.0, 10.0}) {
    const Outcome o = with({{FailureKind::noise, Sensor::imu, 6, 6.004, amount}});
    say("one wrong IMU sample", o, 6, 14);
    EXPECT_LT(o.worst(&Moment::error, 7, 14), 0.009) << amount;
    EXPECT_LT(o.worst(&Moment::sigmas, 6, 14), 4.0) << amount;
  }
}

TEST_F(Faults, ClocksThatGoBackTogetherAreFollowed) {
  for (const double step : {-0.5, -1.0}) {
    const auto all = [step](Sensor s) { return Failure{FailureKind::time_jump, s, 6, for_ever, step}; };
    const Outcome o = with({all(Sensor::imu), all(Sensor::legs), all(Sensor::lidar)});
    say("clocks back", o, 6, 14);
    EXPECT_THAT(o.changes(), testing::ElementsAre("KIL"));
    EXPECT_EQ(o.statistics.clock_steps, 1u);
    EXPECT_THAT(warnings_of(o.statistics), testing::Contains(testing::HasSubstr("clock went back")));
    // The outputs go on in the time that they began with, which is the truth's.
    EXPECT_LT(o.worst(&Moment::error, 0, 14), 0.006);
  }
}

TEST_F(Faults, WhatIsLostNowAndThenCostsLittle) {
  const double reference = with({}).rms_error();
  for (const double share : {0.1, 0.3}) {
    const auto some = [share](Sensor s) { return Failure{FailureKind::random_loss, s, 0, for_ever, share}; };
    const Outcome o = with({some(Sensor::imu), some(Sensor::legs), some(Sensor::lidar)});
    say("random loss", o, 0, 14);
    std::printf("rms %.2f mm, %.2f mm with nothing lost\n", 1e3 * o.rms_error(), 1e3 * reference);
    EXPECT_LT(o.rms_error(), 2 * reference);
    EXPECT_LT(o.worst(&Moment::sigmas, 5, 14), 4.0);
  }
}

TEST_F(Faults, AVibrationFasterThanTheImuIsBorne) {
  const Outcome o = with({{FailureKind::vibration, Sensor::imu, 4, for_ever, 5}});
  say("vibration", o, 4, 14);
  EXPECT_THAT(o.changes(), testing::ElementsAre("KIL"));
  EXPECT_LT(o.rms_error(), 3 * with({}).rms_error());
  // In its first second it is not known yet how much noisier the samples have become.
  EXPECT_LT(o.worst(&Moment::sigmas, 5, 14), 4.0);
}

TEST_F(Faults, SweepsThatContradictTheMapAreRefused) {
  const Outcome o = with({{FailureKind::noise, Sensor::lidar, 6, 7, 1.0}});
  say("scattered points", o, 6, 14);
  const auto& dropped = o.statistics.sensors[static_cast<std::size_t>(Sensor::lidar)].dropped;
  ASSERT_TRUE(dropped.contains("fits nowhere in the map"));
  EXPECT_GE(dropped.at("fits nowhere in the map"), 5u);
  EXPECT_EQ(o.statistics.maps_begun_anew, 0u);
  EXPECT_LT(o.worst(&Moment::error, 6, 14), 0.006);
}

TEST_F(Faults, AClockAheadOfTheImuIsMeasuredAndItsSensorNotUsed) {
  for (const Sensor sensor : {Sensor::lidar, Sensor::legs}) {
    const Outcome o = with({{FailureKind::time_jump, sensor, 0, for_ever, 0.3}});
    say(name_of(sensor), o, 0, 14);
    const StreamHealth& h = o.statistics.health[static_cast<std::size_t>(sensor)];
    EXPECT_GT(h.off_clock, 50u);
    EXPECT_NEAR(h.clock_offset, 0.3, 0.02);
    EXPECT_LT(o.worst(&Moment::error, 6, 14), 0.018);
    EXPECT_THAT(warnings_of(o.statistics), testing::Contains(testing::HasSubstr("ms ahead of the IMU")));
  }
}

TEST_F(Faults, AnImuThatComesLateIsNoFaultOfTheOthers) {
  const Outcome o = with({{FailureKind::delay, Sensor::imu, 0, for_ever, 0.3}});
  say("imu delayed", o, 0, 14);
  EXPECT_EQ(o.modality_at(12), Modality::kil);
  EXPECT_LT(o.worst(&Moment::error, 0, 14), 0.006);
}

// KILVO_SEEDS=20 kilvo_faults_test --gtest_filter=Coasting.*
// Stamps that are off by a hundredth of a second are found out, named and corrected; those of the walk as it is are left alone.
TEST(Clocks, ALidarsOffsetIsFoundAndMended) {
  const FailingWalk walk("room", 2, 30);
  const double error = walk.with({}).rms_error();
  for (const double offset : {0.012, -0.018}) {
    const Outcome o = walk.with({{FailureKind::time_jump, Sensor::lidar, 0, for_ever, offset}});
    const double found = o.statistics.clock_shift[static_cast<std::size_t>(Sensor::lidar)];
    std::printf("offset %.1f ms: found %.2f ms; error %.2f mm, without %.2f mm, at the end %.2f mm\n", 1e3 * offset, -1e3 * found,
                1e3 * o.rms_error(), 1e3 * error, 1e3 * o.moments.back().error);
    EXPECT_NEAR(found, -offset, 0.002);
    EXPECT_THAT(warnings_of(o.statistics), testing::Contains(testing::HasSubstr("set lidar.time_offset to")));
    EXPECT_LT(o.rms_error(), 0.011);
  }
}

TEST(Coasting, ForTwoSecondsSigmaIsAboutTheError) {
  const char* text = std::getenv("KILVO_SEEDS");
  const int seeds = text != nullptr ? std::atoi(text) : 4;
  constexpr double axes = 3;  // `error` is of all of them, `sigma` of the worst
  double squares = 0, sigma = 0, worst = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    const FailingWalk walk("room", static_cast<std::uint64_t>(seed), 10);
    const Outcome o = walk.with({{FailureKind::drop, Sensor::lidar, 6, 8}, {FailureKind::drop, Sensor::legs, 6, 8}});
    const double error = o.worst(&Moment::error, 7.9, 8), s = o.worst(&Moment::sigma, 7.9, 8);
    squares += error * error / axes / seeds;
    sigma += s / seeds;
    worst = std::max(worst, o.worst(&Moment::sigmas, 6, 8));
    EXPECT_LT(o.worst(&Moment::error, 9, 10), 0.02) << seed;
  }
  std::printf("2 s of the IMU alone, %d seeds: RMS error of an axis %.4f m, sigma %.4f m, at most %.1f sigmas\n", seeds, std::sqrt(squares),
              sigma, worst);
  EXPECT_LT(worst, 3.0);
  EXPECT_LT(sigma, 5 * std::sqrt(squares));
  EXPECT_GT(sigma, 0.7 * std::sqrt(squares));
}

// KILVO_STANDING=600 kilvo_faults_test --gtest_filter=Standing.*
TEST(Standing, DriftsByNothing) {
  const char* text = std::getenv("KILVO_STANDING");
  const double seconds = text != nullptr ? std::atof(text) : 15;
  const FailingWalk walk("stand", 1, seconds);
  const Outcome o = walk.with({});
  std::printf("standing %.0f s: worst error %.4f m\n", seconds, o.worst(&Moment::error, 0, seconds));
  EXPECT_LT(o.worst(&Moment::error, 0, seconds), 0.005);
  EXPECT_EQ(o.changes(), std::vector<std::string>{"KIL"});
}

TEST(Standing, WithTheImuAloneItStays) {
  const FailingWalk walk("stand", 1, 16);
  const Outcome o = walk.with({{FailureKind::drop, Sensor::lidar, 5, 15}, {FailureKind::drop, Sensor::legs, 5, 15}});
  std::printf("10 s of the IMU alone: worst error %.4f m, %.1f sigmas\n", o.worst(&Moment::error, 0, 16), o.worst(&Moment::sigmas, 0, 16));
  EXPECT_EQ(o.modality_at(10), Modality::coast);
  EXPECT_LT(o.worst(&Moment::error, 0, 16), 0.007);
  EXPECT_LT(o.worst(&Moment::sigmas, 0, 16), 4.0);
}

TEST_F(Faults, ASensorThatComesLateOrNever) {
  for (const double end : {5.0, for_ever}) {
    for (const Sensor sensor : {Sensor::legs, Sensor::lidar}) {
      const Outcome o = with({{FailureKind::drop, sensor, 0, end}});
      say((std::string(name_of(sensor)) + (end > 10 ? " never" : " 5 s late")).c_str(), o, 0, 14);
      const Modality without = sensor == Sensor::legs ? Modality::li : Modality::ki;
      EXPECT_EQ(o.modality_at(4), without);
      EXPECT_EQ(o.modality_at(13), end > 10 ? without : Modality::kil);
      EXPECT_LT(o.worst(&Moment::error, 0, 14), 0.018);
    }
  }
}

}  // namespace stories_test
}  // namespace kilvo
