#include "kilvo/estimator/clock_steps.hpp"

#include <gtest/gtest.h>
#include <limits>

namespace kilvo {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

Time at(Duration since) { return Time(std::chrono::hours(1000)) + since; }

/// An IMU of 200 Hz and legs of 1 kHz that come 3 ms late, with a camera of 10 Hz that comes 40 ms late. Stamps are of a clock that shows
/// `shift` more.
struct Robot {
  ClockSteps clocks;
  Duration now = milliseconds(0);
  int refused = 0;
  Duration worst_imu{}, worst_legs{}, worst_camera{};  // distance from the time of measurement

  void note(Measurement m, Duration truth, Duration& worst) {
    if (clocks.follow(m) != nullptr) {
      ++refused;
      return;
    }
    const Duration off = stamp_of(m) - at(truth);
    worst = std::max(worst, off < Duration(0) ? -off : off);
  }
  void walk(Duration how_long, Duration shift, Duration camera_shift) {
    for (const Duration end = now + how_long; now < end; now += milliseconds(1)) {
      if (now % milliseconds(5) == Duration(0)) note(ImuSample{.t = at(now + shift)}, now, worst_imu);
      JointSample joints;
      joints.t = at(now - milliseconds(3) + shift);
      note(joints, now - milliseconds(3), worst_legs);
      if (now % milliseconds(100) == milliseconds(40)) {
        CameraImage image;
        image.t = at(now - milliseconds(40) + camera_shift);
        note(image, now - milliseconds(40), worst_camera);
      }
    }
  }
};

TEST(ClockSteps, LeaveStampsAloneThatOnlyGoOn) {
  Robot r;
  r.walk(seconds(2), {}, {});
  EXPECT_EQ(r.clocks.count(), 0u);
  EXPECT_EQ(r.refused, 0);
  EXPECT_EQ(r.worst_imu + r.worst_legs + r.worst_camera, Duration(0));
}

TEST(ClockSteps, PutAllThatGoBackTogetherWhereTheyWereMeasured) {
  for (const Duration step :
       {Duration(-milliseconds(30)), Duration(-milliseconds(150)), Duration(-seconds(1)), Duration(-std::chrono::hours(1))}) {
    SCOPED_TRACE(std::chrono::duration<double>(step).count());
    Robot r;
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
  Robot r;
  r.walk(seconds(2), {}, {});
  r.walk(seconds(2), -seconds(1), {});
  EXPECT_EQ(r.clocks.count(), 1u);
  EXPECT_EQ(r.worst_imu, Duration(0));
  EXPECT_EQ(r.worst_camera, Duration(0));
}

TEST(ClockSteps, LeaveItAloneHoweverLateItIsAfterwards) {
  Robot r;
  r.walk(seconds(2), {}, {});
  r.walk(seconds(3), -seconds(1), {});
  CameraImage late;
  late.t = at(r.now - milliseconds(800));
  r.note(late, r.now - milliseconds(800), r.worst_camera);
  r.walk(seconds(1), -seconds(1), {});
  EXPECT_EQ(r.worst_camera, Duration(0));
}

TEST(ClockSteps, StampsThatAreNoTimesAreRefused) {
  Robot r;
  r.walk(seconds(2), {}, {});
  for (const std::int64_t ns : {std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min()}) {
    Measurement absurd = ImuSample{.t = time_from_ns(ns)};
    EXPECT_NE(r.clocks.follow(absurd), nullptr);
  }
  r.walk(seconds(1), {}, {});
  EXPECT_EQ(r.worst_imu, Duration(0));
}

TEST(ClockSteps, TakeASecondStepLikeTheFirst) {
  Robot r;
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
  Robot r;
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

TEST(ClockSteps, AreNotSeenInAnImuThatComesLateByItself) {
  Robot r;
  r.walk(seconds(2), {}, {});
  // For 0.2 s it says what it measured 0.3 s ago, as the legs do not.
  for (const Duration end = r.now + milliseconds(200); r.now < end; r.now += milliseconds(1)) {
    if (r.now % milliseconds(5) == Duration(0)) {
      Measurement late = ImuSample{.t = at(r.now - milliseconds(300))};
      EXPECT_NE(r.clocks.follow(late), nullptr);
    }
    JointSample joints;
    joints.t = at(r.now - milliseconds(3));
    r.note(joints, r.now - milliseconds(3), r.worst_legs);
  }
  r.walk(seconds(2), {}, {});
  EXPECT_EQ(r.clocks.count(), 0u);
  EXPECT_EQ(r.worst_imu + r.worst_legs + r.worst_camera, Duration(0));
}

TEST(ClockSteps, FollowAClockThatGoesAhead) {
  Robot r;
  r.walk(seconds(2), {}, {});
  const Duration ahead = seconds(10);
  r.now += ahead;
  r.walk(seconds(2), {}, {});
  EXPECT_EQ(r.clocks.count(), 0u);
  EXPECT_EQ(r.refused, 0);
  EXPECT_EQ(r.worst_imu, Duration(0));
}

}  // namespace
}  // namespace kilvo
