#include "kilvo/input/clock_steps.hpp"

#include <gtest/gtest.h>
#include <limits>

namespace kilvo {
namespace clock_steps_test {

using std::chrono::milliseconds;
using std::chrono::seconds;

Time at(Duration since) { return Time(std::chrono::hours(1000)) + since; }

/// An IMU of 200 Hz and legs of 1 kHz that come 3 ms late, with a camera of 10 Hz that comes 40 ms late. Stamps are of a clock that shows
/// `shift` more.
struct StampedRobot {
  ClockSteps clocks;
  Duration now = milliseconds(0);
  int refused = 0;
  bool doubted = false;                                // the sample of the IMU before: the next one tells
  Duration worst_imu{}, worst_legs{}, worst_camera{};  // distance from the time of measurement

  void note(Measurement m, Duration truth, Duration& worst) {
    const auto reason = clocks.follow(m);
    if (sensor_of(m) == Sensor::imu) {
      refused += doubted && !clocks.went_on() ? 1 : 0;
      doubted = reason == Reason::time_jump;
    }
    if (reason && reason != Reason::time_jump) {
      ++refused;
      return;
    }
    if (reason) return;
    const Duration off = stamp_of(m) - at(truth);
    worst = std::max(worst, off < Duration(0) ? -off : off);
  }
  void walk(Duration how_long, Duration shift, Duration camera_shift, bool legs = true) {
    for (const Duration end = now + how_long; now < end; now += milliseconds(1)) {
      if (now % milliseconds(5) == Duration(0)) note(ImuSample{.t = at(now + shift)}, now, worst_imu);
      JointSample joints;
      joints.t = at(now - milliseconds(3) + shift);
      if (legs) note(joints, now - milliseconds(3), worst_legs);
      if (now % milliseconds(100) == milliseconds(40)) {
        CameraImage image;
        image.t = at(now - milliseconds(40) + camera_shift);
        note(image, now - milliseconds(40), worst_camera);
      }
    }
  }
};

TEST(ClockSteps, LeaveStampsAloneThatOnlyGoOn) {
  StampedRobot r;
  r.walk(seconds(2), {}, {});
  EXPECT_EQ(r.clocks.count(), 0u);
  EXPECT_EQ(r.refused, 0);
  EXPECT_EQ(r.worst_imu + r.worst_legs + r.worst_camera, Duration(0));
}

TEST(ClockSteps, PutAllThatGoBackTogetherWhereTheyWereMeasured) {
  for (const Duration step : {Duration(-milliseconds(30)), Duration(-milliseconds(150)), Duration(-seconds(1))}) {
    SCOPED_TRACE(std::chrono::duration<double>(step).count());
    StampedRobot r;
    r.walk(seconds(2), {}, {});
    r.walk(milliseconds(60), step, step);  // until it is sure
    EXPECT_EQ(r.clocks.count(), 1u);
    EXPECT_EQ(r.refused, 2);
    r.worst_legs = r.worst_camera = {};
    r.walk(seconds(2), step, step);
    EXPECT_EQ(r.worst_imu, Duration(0));
    EXPECT_EQ(r.worst_legs, Duration(0));
    EXPECT_EQ(r.worst_camera, Duration(0));
    EXPECT_EQ(r.clocks.last(), -step);
  }
}

TEST(ClockSteps, LeaveASensorAloneWhoseClockDidNotStep) {
  StampedRobot r;
  r.walk(seconds(2), {}, {});
  r.walk(seconds(2), -seconds(1), {});
  EXPECT_EQ(r.clocks.count(), 1u);
  EXPECT_EQ(r.worst_imu, Duration(0));
  EXPECT_EQ(r.worst_camera, Duration(0));
}

TEST(ClockSteps, LeaveItAloneHoweverLateItIsAfterwards) {
  StampedRobot r;
  r.walk(seconds(2), {}, {});
  r.walk(seconds(3), -seconds(1), {});
  CameraImage late;
  late.t = at(r.now - milliseconds(800));
  r.note(late, r.now - milliseconds(800), r.worst_camera);
  r.walk(seconds(1), -seconds(1), {});
  EXPECT_EQ(r.worst_camera, Duration(0));
}

TEST(ClockSteps, StampsThatAreNoTimesAreRefused) {
  StampedRobot r;
  r.walk(seconds(2), {}, {});
  for (const std::int64_t ns : {std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min()}) {
    Measurement absurd = ImuSample{.t = time_from_ns(ns)};
    EXPECT_TRUE(r.clocks.follow(absurd).has_value());
  }
  r.walk(seconds(1), {}, {});
  EXPECT_EQ(r.worst_imu, Duration(0));
}

TEST(ClockSteps, TakeASecondStepLikeTheFirst) {
  StampedRobot r;
  r.walk(seconds(2), {}, {});
  r.walk(seconds(2), -seconds(1), -seconds(1));
  r.walk(milliseconds(60), -seconds(3), -seconds(3));
  r.worst_camera = {};
  r.walk(seconds(2), -seconds(3), -seconds(3));
  EXPECT_EQ(r.clocks.count(), 2u);
  EXPECT_EQ(r.clocks.last(), seconds(2));
  EXPECT_EQ(r.worst_imu, Duration(0));
  EXPECT_EQ(r.worst_camera, Duration(0));
}

TEST(ClockSteps, AreNotSeenInSingleSamplesThatAreAheadOrLate) {
  StampedRobot r;
  r.walk(seconds(2), {}, {});
  for (const Duration off : {Duration(std::chrono::hours(1)), Duration(-seconds(1)), Duration(seconds(5)), Duration(milliseconds(150)),
                             Duration(milliseconds(500)), Duration(-milliseconds(300))}) {
    Measurement wrong = ImuSample{.t = at(r.now + off)};
    r.clocks.follow(wrong);
    r.walk(milliseconds(100), {}, {});
  }
  EXPECT_EQ(r.clocks.count(), 0u);
  EXPECT_EQ(r.refused, 0);
  EXPECT_EQ(r.worst_imu + r.worst_legs + r.worst_camera, Duration(0));
}

TEST(ClockSteps, OfTheImuAloneAreFollowedEitherWay) {
  for (const Duration step : {milliseconds(30), milliseconds(-30), milliseconds(120), milliseconds(-300), milliseconds(5000)}) {
    SCOPED_TRACE(std::chrono::duration<double>(step).count());
    StampedRobot r;
    r.walk(seconds(2), {}, {});
    const auto others_stay = [&r, step](Duration how_long) {
      for (const Duration end = r.now + how_long; r.now < end; r.now += milliseconds(1)) {
        if (r.now % milliseconds(5) == Duration(0)) r.note(ImuSample{.t = at(r.now + step)}, r.now, r.worst_imu);
        JointSample joints;
        joints.t = at(r.now - milliseconds(3));
        r.note(joints, r.now - milliseconds(3), r.worst_legs);
      }
    };
    others_stay(milliseconds(200));
    EXPECT_EQ(r.clocks.count(), 1u);
    EXPECT_EQ(r.clocks.last(), -step);
    EXPECT_LE(r.refused, 9);
    r.walk(seconds(2), {}, {});
    EXPECT_EQ(r.clocks.count(), 2u) << "and when it is put right again";
    EXPECT_LE(r.refused, 18);
    EXPECT_EQ(r.worst_imu + r.worst_legs + r.worst_camera, Duration(0));
  }
}

TEST(ClockSteps, AreNotSeenInGaps) {
  for (const bool legs_too : {false, true}) {
    StampedRobot r;
    r.walk(seconds(2), {}, {});
    for (const Duration gap : {milliseconds(20), milliseconds(60), milliseconds(400)}) {
      for (const Duration end = r.now + gap; r.now < end; r.now += milliseconds(1)) {
        JointSample joints;
        joints.t = at(r.now - milliseconds(3));
        if (!legs_too) r.note(joints, r.now - milliseconds(3), r.worst_legs);
      }
      r.walk(seconds(1), {}, {});
    }
    EXPECT_EQ(r.clocks.count(), 0u);
    EXPECT_LE(r.refused, legs_too ? 3 : 0);
    EXPECT_EQ(r.worst_imu + r.worst_legs + r.worst_camera, Duration(0));
  }
}

TEST(ClockSteps, AreNotSeenWhereLegsHaveGone) {
  StampedRobot r;
  r.walk(seconds(2), {}, {});
  for (Duration ms{}; ms < seconds(3); ms += milliseconds(5)) {
    r.now += milliseconds(ms == seconds(1) ? 60 : 5);
    r.note(ImuSample{.t = at(r.now)}, r.now, r.worst_imu);
  }
  EXPECT_EQ(r.clocks.count(), 0u);
  EXPECT_EQ(r.worst_imu, Duration(0));
}

TEST(ClockSteps, FollowAClockThatGoesAhead) {
  StampedRobot r;
  r.walk(seconds(2), {}, {});
  const Duration ahead = seconds(10);
  r.now += ahead;
  r.walk(seconds(2), {}, {});
  EXPECT_EQ(r.clocks.count(), 0u);
  EXPECT_LE(r.refused, 2) << "until the legs show it, and the next sample";
  EXPECT_EQ(r.worst_imu, Duration(0));
}

TEST(ClockSteps, OneStampOfTheImuAheadOfAllOthersCostsOneSample) {
  for (const int ms : {12, 20, 40, 80, 150, 250, 500, 950}) {
    for (const bool legs : {true, false}) {
      SCOPED_TRACE(testing::Message() << ms << " ms, legs " << legs);
      StampedRobot r;
      r.walk(seconds(2), {}, {}, legs);
      Measurement wrong = ImuSample{.t = at(r.now + milliseconds(ms))};
      EXPECT_TRUE(r.clocks.follow(wrong).has_value());
      r.now += milliseconds(1);
      r.walk(seconds(2), {}, {}, legs);
      EXPECT_EQ(r.refused, 0);
      EXPECT_EQ(r.worst_imu, Duration(0));
    }
  }
}

// For 0.9 s its messages come 0.45 s late, then at once again: late ones come between those that do not.
TEST(ClockSteps, AnImuThatComesLateForAMomentHasNotStepped) {
  StampedRobot r;
  r.walk(seconds(2), {}, {});
  const Duration from = r.now, until = from + milliseconds(900), late = milliseconds(450);
  for (const Duration end = until + seconds(1); r.now < end; r.now += milliseconds(1)) {
    const bool is_due = r.now % milliseconds(5) == Duration(0);
    if (is_due && r.now - late >= from && r.now - late < until) r.note(ImuSample{.t = at(r.now - late)}, r.now - late, r.worst_imu);
    if (is_due && r.now >= until) r.note(ImuSample{.t = at(r.now)}, r.now, r.worst_imu);
    JointSample joints;
    joints.t = at(r.now - milliseconds(3));
    r.note(joints, r.now - milliseconds(3), r.worst_legs);
  }
  EXPECT_EQ(r.clocks.count(), 0u);
  EXPECT_LE(r.refused, 90) << "of those that were late when newer ones had come";
  EXPECT_EQ(r.worst_imu, Duration(0));
}

// Samples are missing, as many stamps shake by 2 ms, and nobody else speaks.
TEST(ClockSteps, GapsAndJitterOfAnImuAloneCostNothing) {
  for (const int gap : {0, 20, 60, 100, 200, 400}) {
    SCOPED_TRACE(gap);
    StampedRobot r;
    for (int i = 0; i < 400; ++i) {
      r.now += milliseconds(i == 200 ? gap : 5);
      const Duration jitter = milliseconds(i * 7 % 5 - 2);
      r.note(ImuSample{.t = at(r.now + jitter)}, r.now + jitter, r.worst_imu);
    }
    EXPECT_EQ(r.refused, 0);
    EXPECT_EQ(r.worst_imu, Duration(0));
  }
}

TEST(ClockSteps, AGapOfTheImuWhileOthersGoOnCostsNothing) {
  StampedRobot r;
  r.walk(seconds(2), {}, {});
  for (const Duration end = r.now + milliseconds(400); r.now < end; r.now += milliseconds(1)) {
    JointSample joints;
    joints.t = at(r.now - milliseconds(3));
    r.note(joints, r.now - milliseconds(3), r.worst_legs);
  }
  r.walk(seconds(1), {}, {});
  EXPECT_EQ(r.refused, 0);
}

// What was missing comes 0.3 s late, while what should come now is late as well: a time that had gone back would repeat what was there.
TEST(ClockSteps, WhatFillsAGapIsLateAndNoStep) {
  StampedRobot r;
  r.walk(seconds(2), {}, {});
  const Duration gap = r.now;
  const auto walk_without_imu = [&](Duration how_long, std::optional<Duration> late) {
    for (const Duration end = r.now + how_long; r.now < end; r.now += milliseconds(1)) {
      if (late && r.now % milliseconds(5) == Duration(0)) {
        Measurement sample = ImuSample{.t = at(r.now - *late)};
        EXPECT_EQ(r.clocks.follow(sample), Reason::late);
      }
      JointSample joints;
      joints.t = at(r.now - milliseconds(3));
      r.note(joints, r.now - milliseconds(3), r.worst_legs);
    }
  };
  walk_without_imu(milliseconds(100), {});
  r.walk(milliseconds(200), {}, {});
  walk_without_imu(milliseconds(95), r.now - gap);
  r.walk(seconds(2), {}, {});
  EXPECT_EQ(r.clocks.count(), 0u);
  EXPECT_EQ(r.worst_imu, Duration(0));
}

TEST(ClockSteps, ARecordingThatIsPlayedAgainIsARestartWithItsOwnStamps) {
  StampedRobot r;
  r.walk(seconds(60), {}, {});
  EXPECT_EQ(r.clocks.restarts(), 0u);
  r.walk(seconds(1), -seconds(60), -seconds(60));
  EXPECT_EQ(r.clocks.restarts(), 1u);
  EXPECT_EQ(r.clocks.count(), 0u);
  Measurement m = ImuSample{.t = at(seconds(1))};
  EXPECT_FALSE(r.clocks.follow(m).has_value());
  EXPECT_EQ(stamp_of(m), at(seconds(1)));
}

}  // namespace clock_steps_test
}  // namespace kilvo
