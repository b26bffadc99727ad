// What the senses say of each other: wrong mounts, wrong stamps, samples at the end of a range, a world that changed.
#include <array>
#include <cstdio>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <memory>

#include "tests/faults/failing_walk.hpp"

namespace kilvo {
namespace senses_test {

using lab::Failure;
using lab::FailureKind;
using test::Changes;
using test::FailingWalk;
using test::Moment;
using test::Outcome;

constexpr std::array<bool, sensor_count> li = {true, false, true, false}, ki = {true, true, false, false}, kil = {true, true, true, false},
                                         liv = {true, false, true, true};

bool has(const Outcome& o, Reason r) {
  return std::ranges::any_of(o.statistics.events, [r](const Event& e) { return e.reason == r; });
}

// The robot does not move for so many seconds from 5 s on, as far as any sense can tell.
Outcome carried(const FailingWalk& walk, int seconds, const std::array<bool, sensor_count>& used = li) {
  const auto carry = [seconds](Measurement& m, double s) {
    if (s >= 5 && s < 5 + seconds) return false;
    if (s >= 5) std::visit([seconds](auto& x) { x.t -= std::chrono::seconds(seconds); }, m);
    return true;
  };
  return walk.with({}, {used, carry, {}, [seconds](double s) { return s < 5 ? s : s + seconds; }});
}

class Senses : public testing::Test {
 protected:
  static void SetUpTestSuite() { walk_ = std::make_unique<FailingWalk>("room", 1, 14); }
  static void TearDownTestSuite() { walk_.reset(); }
  static std::uint64_t dropped(const Outcome& o, Sensor s) {
    std::uint64_t sum = 0;
    for (const auto& [cause, count] : o.statistics.sensors[static_cast<std::size_t>(s)].dropped)
      sum += cause == "before the start" ? 0 : count;
    return sum;
  }
  static std::unique_ptr<FailingWalk> walk_;
};
std::unique_ptr<FailingWalk> Senses::walk_;

TEST_F(Senses, OneStampOfTheImuAheadCostsOneSample) {
  const FailingWalk walk("room", 1, 6.5, true);
  for (const double ahead : {0.02, 0.04, 0.08, 0.15, 0.22, 0.6, 0.95}) {
    for (const auto& used : {kil, li, liv}) {
      SCOPED_TRACE(testing::Message() << ahead << " s, legs " << used[1] << ", camera " << used[3]);
      const auto stamp = [ahead, n = 0](Measurement& m, double) mutable {
        if (auto* imu = std::get_if<ImuSample>(&m); imu != nullptr && ++n == 1000) imu->t += from_seconds(ahead);
        return true;
      };
      const Outcome o = walk.with({}, {used, stamp, {}});
      EXPECT_EQ(dropped(o, Sensor::imu), 1u);
      EXPECT_EQ(o.statistics.imu_outages, 0u);
      EXPECT_LT(o.worst(&Moment::error, 0, 14), 0.01);
      EXPECT_LT(o.worst(&Moment::sigmas, 1, 14), 4.0);
    }
  }
}

// What real IMUs do: stamps that shake, samples that are lost.
TEST_F(Senses, JitterAndGapsOfTheImuCostNoSampleThatCame) {
  const FailingWalk walk("room", 1, 6.5);
  for (const double gap : {0.0, 0.02, 0.06, 0.09, 0.2}) {
    SCOPED_TRACE(gap);
    const auto shake = [gap, n = 0](Measurement& m, double s) mutable {
      auto* imu = std::get_if<ImuSample>(&m);
      if (imu == nullptr) return true;
      imu->t += std::chrono::milliseconds(gap == 0 ? ++n * 7 % 5 - 2 : 0);
      return s < 5 || s >= 5 + gap;
    };
    const Outcome o = walk.with({}, {li, shake, {}});
    std::printf("gap of %.2f s: %.3f m, %.1f sigmas\n", gap, o.worst(&Moment::error, 0, 14), o.worst(&Moment::sigmas, 1, 14));
    EXPECT_EQ(dropped(o, Sensor::imu), 0u);
    EXPECT_LT(o.worst(&Moment::sigmas, 1, 14), 4.0);
    EXPECT_LT(o.worst(&Moment::error, 5.5, 14), 0.03);
  }
}

// Forty milliseconds of accelerations that nobody has felt, while the sweeps are good.
TEST_F(Senses, ABurstOfWrongAccelerationsIsOutlivedWithSweeps) {
  const FailingWalk walk("room", 1, 6.5);
  // Those of 200 an IMU may measure: until the next sweep nothing tells.
  for (const auto& [samples, accel] : {std::pair(8, 900.0), std::pair(8, 300.0), std::pair(8, 200.0), std::pair(40, 900.0)}) {
    for (const int phase : {0, 5, 15}) {
      SCOPED_TRACE(testing::Message() << samples << " samples of " << accel << " m/s^2, " << phase);
      const auto hit = [phase, samples = samples, accel = accel, n = 0](Measurement& m, double) mutable {
        auto* imu = std::get_if<ImuSample>(&m);
        if (imu != nullptr && ++n > 1000 + phase && n <= 1000 + phase + samples) imu->accel.x() = accel;
        return true;
      };
      const Outcome o = walk.with({}, {li, hit, {}});
      std::printf("%d samples of %.0f m/s^2, %d: %.3f m, later %.3f m, %.1f sigmas\n", samples, accel, phase,
                  o.worst(&Moment::error, 0, 14), o.worst(&Moment::error, 5.5, 14), o.worst(&Moment::sigmas, 1, 14));
      EXPECT_LT(o.worst(&Moment::error, accel == 200 ? 5.5 : 1, 14), 0.1);
      EXPECT_LT(o.worst(&Moment::sigmas, accel == 200 ? 5.5 : 1, 14), 4.0);
      EXPECT_EQ(o.statistics.rollbacks, 0u);
    }
  }
}

// Both soles are then faster than a foot that swings, and no robot walks so.
TEST_F(Senses, OnTheLegsAVelocityThatNoFootHasIsCorrected) {
  for (const double accel : {20.0, -20.0}) {
    for (const int axis : {0, 1}) {
      const auto hit = [accel, axis](Measurement& m, double s) {
        if (auto* imu = std::get_if<ImuSample>(&m); imu != nullptr && s >= 8 && s < 8.2) imu->accel[axis] += accel;
        return true;
      };
      const Outcome o = walk_->with({}, {ki, hit, {}});
      std::printf("%.0f m/s^2 along %d: %.3f m at the end\n", accel, axis, o.worst(&Moment::error, 13, 14));
      EXPECT_LT(o.worst(&Moment::error, 13, 14), 0.5);
    }
  }
}

// Two samples that no IMU measures; and two of what one might, which make a velocity that nobody has.
TEST_F(Senses, OnTheLegsAWrongAccelerationLeavesAnHonestEstimate) {
  for (const auto& [samples, accel] : {std::pair(2, 4000.0), std::pair(2, 900.0)}) {
    const auto hit = [samples = samples, accel = accel, n = 0](Measurement& m, double) mutable {
      auto* imu = std::get_if<ImuSample>(&m);
      if (imu != nullptr && ++n > 1600 && n <= 1600 + samples) imu->accel.x() = accel;
      return true;
    };
    const Outcome o = walk_->with({}, {ki, hit, {}});
    std::printf("%d samples of %.0f m/s^2: %.3f m, %.1f sigmas, %d rollbacks\n", samples, accel, o.worst(&Moment::error, 0, 14),
                o.worst(&Moment::sigmas, 0, 14), static_cast<int>(o.statistics.rollbacks));
    EXPECT_LT(o.worst(&Moment::sigmas, 5, 14), 4.0) << accel;
    EXPECT_LT(o.worst(&Moment::error, 5, 14), 0.5) << accel;
  }
}

TEST_F(Senses, ARecordingPlayedAgainIsAnotherEpoch) {
  const auto epochs = walk_->twice();
  ASSERT_EQ(epochs.size(), 2u);
  std::printf("played again: worst error %.2f mm, then %.2f mm\n", 1e3 * epochs[0].first, 1e3 * epochs[1].first);
  EXPECT_LT(epochs[0].first, 0.006);
  EXPECT_LT(epochs[1].first, 0.006);
  EXPECT_LT(epochs[1].second, 2.0) << "the stamps are those of the recording";
}

// All sensors are covered for four seconds, and their clocks stand still: the robot is somewhere else at once. That nobody can know until
// sweeps have fitted nowhere for two seconds; from then on each output says so. (Not of the attitude: the IMU was never told of the
// carrying.)
TEST_F(Senses, ARobotThatWasCarriedAwayDoesNotSayThatItKnowsWhere) {
  const FailingWalk walk("room", 1, 20);
  const Outcome o = carried(walk, 8);
  ASSERT_EQ(o.statistics.maps_begun_anew, 1u);
  const auto anew = std::ranges::find(o.statistics.events, Reason::map_begun_anew, &Event::reason);
  ASSERT_NE(anew, o.statistics.events.end());
  const double from = walk.seconds_of(anew->t) + 0.1;
  std::printf("carried: error %.2f m, known at %.2f s: sigma %.2f m, at most %.1f sigmas\n", o.worst(&Moment::error, from, 20), from,
              o.worst(&Moment::sigma, from, 20), o.worst(&Moment::sigmas, from, 20));
  EXPECT_GT(o.worst(&Moment::error, from, 20), 0.5);
  EXPECT_LT(from, 7.6);
  EXPECT_LT(o.worst(&Moment::sigmas, from, 20), 4.0);
  EXPECT_TRUE(o.statistics.diverged);
}

TEST_F(Senses, ARobotThatWasCarriedAMetreOrTwoIsFound) {
  const Outcome o = carried(*walk_, 4);
  std::printf("carried: error %.3f m once it is found\n", o.worst(&Moment::error, 6, 20));
  EXPECT_LT(o.worst(&Moment::error, 6, 20), 0.02);
  EXPECT_LT(o.worst(&Moment::sigmas, 6, 20), 4.0);
  EXPECT_TRUE(has(o, Reason::not_where_predicted));
  EXPECT_EQ(o.statistics.maps_begun_anew, 0u);
}

// Farther away and turned, and on its feet again at once: they stand where it is now.
TEST_F(Senses, ARobotThatWasCarriedAndTurnedIsFoundWithItsFeet) {
  const FailingWalk walk("room", 1, 18);
  for (const auto& used : {kil, li}) {
    for (const int seconds : {3, 5}) {
      const Outcome o = carried(walk, seconds, used);
      std::printf("carried for %d s, legs %d: error %.3f m once it is found\n", seconds, used[1], o.worst(&Moment::error, 6, 20));
      EXPECT_LT(o.worst(&Moment::error, 6, 20), 0.02);
      EXPECT_LT(o.worst(&Moment::sigmas, 6, 20), 4.0);
      EXPECT_TRUE(has(o, Reason::not_where_predicted));
      EXPECT_EQ(o.statistics.maps_begun_anew, 0u);
    }
  }
}

// Until the next sweep nothing tells; then that sweep, and what the samples were before.
TEST_F(Senses, SamplesOfTheImuThatAreWrongForAMomentAreNotUsed) {
  struct Fault {
    const char* name;
    std::function<void(ImuSample&)> of;
    double lasts = 0.2;  // s
  };
  const std::array faults = {Fault{"accelerometer along the walk", [](ImuSample& s) { s.accel.x() += 20; }},
                             Fault{"accelerometer across it", [](ImuSample& s) { s.accel.y() -= 20; }},
                             Fault{"accelerometer upwards, short", [](ImuSample& s) { s.accel.z() += 60; }, 0.05},
                             Fault{"accelerometer along the walk, short", [](ImuSample& s) { s.accel.x() -= 60; }, 0.05},
                             Fault{"gyro about the vertical", [](ImuSample& s) { s.gyro.z() += 3; }},
                             Fault{"gyro about the walk", [](ImuSample& s) { s.gyro.x() -= 3; }}};
  for (const Fault& fault : faults) {
    for (const auto& used : {kil, li}) {
      for (const double at : {8.03, 8.07}) {
        SCOPED_TRACE(testing::Message() << fault.name << ", legs " << used[1] << ", at " << at);
        const auto changed = [&](Measurement& m, double s) {
          if (auto* imu = std::get_if<ImuSample>(&m); imu != nullptr && s >= at && s < at + fault.lasts) fault.of(*imu);
          return true;
        };
        const Outcome o = walk_->with({}, {used, changed, {}});
        std::printf("%s, legs %d, %.2f: worst %.1f mm, later %.1f mm\n", fault.name, used[1], at, 1e3 * o.worst(&Moment::error, 0, 14),
                    1e3 * o.worst(&Moment::error, 9, 14));
        EXPECT_LT(o.worst(&Moment::error, 9, 14), 0.03);
        EXPECT_LT(o.worst(&Moment::sigmas, 9, 14), 4.0);
        EXPECT_FALSE(o.statistics.diverged);
      }
    }
  }
}

TEST_F(Senses, AWrongMountOfTheLidarIsSaidWithTheSensesThatContradict) {
  const double degree = M_PI / 180;
  for (const auto& [axis, angle] : {std::pair(Eigen::Vector3d(0, 0, 1), 90 * degree), std::pair(Eigen::Vector3d(1, 0, 0), 180 * degree),
                                    std::pair(Eigen::Vector3d(0, 1, 0), 30 * degree)}) {
    const Outcome o = walk_->with({}, {li, {}, [&](Robot& r) { r.lidar.T_imu_lidar.R = r.lidar.T_imu_lidar.R * SO3::Exp(angle * axis); }});
    std::printf("mount turned by %.0f degrees: error %.2f m, diverged %d\n", angle / degree, o.worst(&Moment::error, 0, 14),
                o.statistics.diverged);
    EXPECT_TRUE(o.statistics.diverged || has(o, Reason::inconsistent)) << angle / degree;
    EXPECT_THAT(warnings_of(o.statistics), testing::Contains(testing::HasSubstr("contradict each other")));
  }
}

TEST_F(Senses, WarningsGoOutWithTheOutputWhenTheyBecomeTrue) {
  const Outcome o =
      walk_->with({{FailureKind::freeze, Sensor::lidar, 6, 8, 0}},
                  {li, {}, [](Robot& r) { r.lidar.T_imu_lidar.R = SO3::Exp(Eigen::Vector3d(0, 0.35, 0)) * r.lidar.T_imu_lidar.R; }});
  std::size_t warnings = 0;
  for (const Event& kept : o.statistics.events) {
    if (row_of(kept.reason).severity == Severity::notice) continue;
    const auto same = [&kept](const auto& out) { return out.second.reason == kept.reason && out.second.sensor == kept.sensor; };
    const auto first = std::ranges::find_if(o.events, same);
    if (kept.t > walk_->time(13.9)) continue;  // of finish()
    ++warnings;
    ASSERT_NE(first, o.events.end()) << text_of(kept);
    EXPECT_NEAR(first->first, to_seconds(first->second.t - walk_->time(0)), 0.11) << text_of(kept) << ": with the next output";
    EXPECT_GE(kept.count, first->second.count) << text_of(kept);
  }
  EXPECT_GE(warnings, 2u) << "the mount, and that the LiDAR froze";
}

TEST_F(Senses, AgreeWhereNothingIsWrong) {
  for (const auto& used : {std::optional<std::array<bool, sensor_count>>(), std::optional(li), std::optional(ki)}) {
    const Outcome o = walk_->with({}, {used, {}, {}});
    EXPECT_FALSE(o.statistics.diverged);
    EXPECT_THAT(warnings_of(o.statistics), testing::IsEmpty());
  }
}

TEST(ClippedAccelerometer, NeedsNoSearchAndCostsLittle) {
  const auto searches = [](const Outcome& o) { return o.statistics.searches; };
  const Outcome whole = FailingWalk("room", 4, 10).with({});
  const Outcome cut = FailingWalk("room", 4, 10, false, [](lab::SimulatorConfig& c) {
                        c.imu.accel_range = 12;
                      }).with({}, {{}, {}, [](Robot& r) { r.imu.accel_range = 12; }});
  const std::uint64_t clipped = cut.statistics.health[0].clipped;
  std::printf("%d samples clipped: rms %.2f mm, %.2f mm without\n", static_cast<int>(clipped), 1e3 * cut.rms_error(),
              1e3 * whole.rms_error());
  EXPECT_GT(clipped, 5u);
  EXPECT_EQ(searches(cut), 0u);
  EXPECT_LT(cut.rms_error(), 1.5 * whole.rms_error());
}

// Sweeps of so few points that they hold nothing: they are as if they had not come, and the ground under the feet is told by the map alone.
TEST_F(Senses, SweepsOfAFewPointsCarryNothing) {
  const auto thinned = [](Measurement& m, double s) {
    auto* scan = std::get_if<LidarScan>(&m);
    if (scan == nullptr || s < 6 || s > 10) return true;
    std::vector<LidarPoint> few;
    for (std::size_t i = 0; i < scan->points.size(); i += 200) few.push_back(scan->points[i]);
    scan->points = std::move(few);
    return true;
  };
  const Outcome few = walk_->with({}, {{}, thinned, {}, {}}), none = walk_->with({{FailureKind::drop, Sensor::lidar, 6.1, 10.1}});
  const double error = few.worst(&Moment::error, 6.5, 9.9), sigma = few.worst(&Moment::sigma, 6.5, 9.9);
  std::printf("20 points in a sweep: worst %.2f mm, none %.2f mm; sigma %.2f mm, none %.2f mm\n", 1e3 * error,
              1e3 * none.worst(&Moment::error, 6.5, 9.9), 1e3 * sigma, 1e3 * none.worst(&Moment::sigma, 6.5, 9.9));
  EXPECT_EQ(few.modality_at(8), Modality::ki);
  EXPECT_NEAR(error, none.worst(&Moment::error, 6.5, 9.9), 0.001);
  EXPECT_NEAR(sigma, none.worst(&Moment::sigma, 6.5, 9.9), 0.1 * sigma);
  EXPECT_LT(few.worst(&Moment::sigmas, 6.5, 14), 4.0);
}

// A running robot whose torso rings hard at each touchdown; the range of its IMU is not given.
TEST(ClippedAccelerometer, AtThreeGInARunCostsLittleAndTheGyroIsTrusted) {
  const auto running = [](const char* what, double range) {
    const FailingWalk walk("run", 4, 10, false, [range](lab::SimulatorConfig& c) {
      c.wear.impact = 45;
      c.imu.accel_range = range;
    });
    const Outcome o = walk.with({}, {{}, {}, [](Robot& r) { r.imu.accel_range = r.imu.gyro_range = 0; }, {}});
    std::printf("%s: %d samples clipped, rms %.2f mm\n", what, static_cast<int>(o.statistics.health[0].clipped), 1e3 * o.rms_error());
    EXPECT_EQ(o.statistics.searches, 0u) << what;
    EXPECT_FALSE(has(o, Reason::gyro_clipped)) << what;
    return o;
  };
  const Outcome whole = running("whole", 160);
  EXPECT_EQ(whole.statistics.health[0].clipped, 0u);
  for (const Outcome& cut : {running("3 g", 3 * 9.8), running("2 g", 2 * 9.80665)}) {
    EXPECT_GT(cut.statistics.health[0].clipped, 40u);
    EXPECT_LT(cut.rms_error(), 1.5 * whole.rms_error());
  }
}

// The first sample at the end of a range that is not given: a truth that is 29.4 m/s^2 or 250 degrees a second away from what it says.
TEST_F(Senses, OneClippedSampleIsSeenAndCostsLittle) {
  const auto free = [](Robot& r) { r.imu.accel_range = r.imu.gyro_range = 0; };
  for (const bool of_gyro : {false, true}) {
    const auto clip = [of_gyro, n = 0](Measurement& m, double) mutable {
      auto* imu = std::get_if<ImuSample>(&m);
      if (imu == nullptr || ++n != 1600) return true;
      (of_gyro ? imu->gyro.z() : imu->accel.x()) = of_gyro ? 250 * M_PI / 180 : 29.4;
      return true;
    };
    for (const bool with_legs : {true, false}) {
      const std::optional<std::array<bool, sensor_count>> used = with_legs ? std::nullopt : std::optional(li);
      const Outcome whole = walk_->with({}, {used, {}, free, {}}), o = walk_->with({}, {used, clip, free, {}});
      const double as_usual = whole.worst(&Moment::error, 0, 14);
      std::printf(
          "one sample of the %s clipped, %s: worst %.2f mm, %.2f mm after 0.3 s, %.2f mm without; %.1f sigmas, bias %.3f m/s^2, %d "
          "searches\n",
          of_gyro ? "gyro" : "accelerometer", with_legs ? "KIL" : "LI", 1e3 * o.worst(&Moment::error, 0, 14),
          1e3 * o.worst(&Moment::error, 8.3, 14), 1e3 * as_usual, o.worst(&Moment::sigmas, 0, 14), o.worst(&Moment::accel_bias, 5, 14),
          static_cast<int>(o.statistics.searches));
      EXPECT_EQ(o.statistics.health[0].clipped, 1u);
      EXPECT_TRUE(has(o, of_gyro ? Reason::gyro_clipped : Reason::accel_clipped));
      // Without legs nothing tells of a velocity that is wrong by 0.15 m/s before the next sweep.
      EXPECT_LT(o.worst(&Moment::error, 0, 14), as_usual + (with_legs ? 0.003 : 0.015));
      EXPECT_LT(o.worst(&Moment::error, 8.3, 14), as_usual + 0.0015);
      EXPECT_LT(o.worst(&Moment::sigmas, 0, 14), 4.0);
      EXPECT_LT(o.worst(&Moment::accel_bias, 5, 14), 0.2);
      if (with_legs && !of_gyro) {
        EXPECT_EQ(o.statistics.searches, 0u);
      }
    }
  }
}

// Ranges end before the filter of the IMU: two samples of 20 and 14 m/s^2 stand for a knock of 45, and no value is at the end of a range.
TEST_F(Senses, AKnockThatNoSampleShowsWholeIsNotTakenForABias) {
  const auto hidden = [n = 0](Measurement& m, double) mutable {
    auto* imu = std::get_if<ImuSample>(&m);
    if (imu == nullptr) return true;
    ++n;
    if (n == 1600 || n == 1601) imu->accel.y() += n == 1600 ? 20 : 14;  // with the sign of what is missing
    return true;
  };
  const std::optional<std::array<bool, sensor_count>> used(li);
  const Outcome whole = walk_->with({}, {used, {}, {}, {}}), o = walk_->with({}, {used, hidden, {}, {}});
  const double as_usual = whole.worst(&Moment::error, 0, 14);
  std::printf("a knock that is shown in part: worst %.2f mm after 0.3 s, %.2f mm without; %.1f sigmas, bias %.3f m/s^2\n",
              1e3 * o.worst(&Moment::error, 8.3, 14), 1e3 * as_usual, o.worst(&Moment::sigmas, 8.3, 14),
              o.worst(&Moment::accel_bias, 5, 14));
  EXPECT_LT(o.worst(&Moment::error, 8.3, 14), as_usual + 0.0015);
  EXPECT_LT(o.worst(&Moment::sigmas, 8.3, 14), 4.0);
  EXPECT_LT(o.worst(&Moment::accel_bias, 5, 14), 0.2);
}

// What the covariance of an IMU knows nothing of. The sweeps see all of it.
TEST_F(Senses, AnImuThatMeasuresOtherwiseFromNowOnIsFoundByTheSweeps) {
  struct Fault {
    const char* name;
    std::function<void(ImuSample&)> of;
    double until = 100;  // s
  };
  const std::array faults = {Fault{"bias of the gyro, about the vertical", [](ImuSample& s) { s.gyro.z() += 0.1; }},
                             Fault{"bias of the gyro, about the walk", [](ImuSample& s) { s.gyro.x() += 0.3; }},
                             Fault{"bias of the accelerometer, level", [](ImuSample& s) { s.accel.x() += 0.5; }},
                             Fault{"bias of the accelerometer, upwards", [](ImuSample& s) { s.accel.z() += 2; }},
                             Fault{"turns for 0.3 s that nothing makes", [](ImuSample& s) { s.gyro.z() += 0.8; }, 8.3},
                             Fault{"scale of the gyro", [](ImuSample& s) { s.gyro *= 1.1; }},
                             Fault{"clock", [](ImuSample& s) { s.t += std::chrono::milliseconds(40); }}};
  for (const Fault& fault : faults) {
    for (const auto& used : {kil, li}) {
      SCOPED_TRACE(testing::Message() << fault.name << ", legs " << used[1]);
      const auto changed = [&fault](Measurement& m, double s) {
        if (auto* imu = std::get_if<ImuSample>(&m); imu != nullptr && s >= 8 && s < fault.until) fault.of(*imu);
        return true;
      };
      // The stamps of the outputs are the IMU's, but where the legs find a step of its clock.
      const bool follows_clock = &fault == &faults.back() && !used[1];
      const auto where = [](double s) { return s < 8.04 ? s : s - 0.04; };
      const Outcome o = walk_->with({}, {used, changed, {}, follows_clock ? where : std::function<double(double)>{}});
      std::printf("%s, legs %d: worst %.1f mm, at the end %.1f mm; %.1f sigmas\n", fault.name, used[1],
                  1e3 * o.worst(&Moment::error, 0, 14), 1e3 * o.worst(&Moment::error, 13, 14), o.worst(&Moment::sigmas, 9, 14));
      EXPECT_LT(o.worst(&Moment::error, 0, 14), 0.1);
      EXPECT_THAT(warnings_of(o.statistics), testing::Not(testing::IsEmpty()));
      if (fault.until < 14) {
        EXPECT_FALSE(o.statistics.diverged) << "it is right again";
      }
      EXPECT_LT(o.worst(&Moment::error, 13, 14), 0.03);
    }
  }
}

// On the legs alone: both feet seem to rise from then on, which the ground does not let them.
TEST_F(Senses, APushThatDidNotHappenIsFoundByTheFeet) {
  const auto pushed = [n = 0](Measurement& m, double) mutable {
    if (auto* imu = std::get_if<ImuSample>(&m); imu != nullptr && ++n >= 1200 && n < 1204) imu->accel.z() += 15;
    return true;
  };
  const std::optional<std::array<bool, sensor_count>> used(ki);
  const Outcome whole = walk_->with({}, {used, {}, {}, {}}), o = walk_->with({}, {used, pushed, {}, {}});
  const double as_usual = whole.worst(&Moment::error, 0, 14);
  std::printf("a push of 0.3 m/s that did not happen: worst %.0f mm, %.0f mm without; %.1f sigmas\n", 1e3 * o.worst(&Moment::error, 0, 14),
              1e3 * as_usual, o.worst(&Moment::sigmas, 1, 14));
  EXPECT_LT(o.worst(&Moment::error, 0, 14), 0.15);
  EXPECT_LT(o.worst(&Moment::sigmas, 1, 14), 6.0);
}

// It is told with its reason, sensor by sensor, what came before an IMU that never came; and no more of it waits than a few seconds.
TEST_F(Senses, WithoutAnyImuMessageAllElseIsDroppedAndTold) {
  Estimator estimator(walk_->settings().robot, walk_->settings().estimator, walk_->used());
  std::array<std::uint64_t, sensor_count> came{};
  std::size_t outputs = 0;
  const auto waiting = [&](std::size_t s) {
    std::uint64_t out = came[s];
    for (const auto& [cause, count] : estimator.statistics().sensors[s].dropped) out -= count;
    return out;
  };
  constexpr std::size_t legs = 1, lidar = 2;
  std::uint64_t most_scans = 0, most_legs = 0;
  walk_->play({{FailureKind::drop, Sensor::imu, 0, std::numeric_limits<double>::infinity()}}, [&](Measurement m) {
    ++came[static_cast<std::size_t>(sensor_of(m))];
    outputs += estimator.push(std::move(m)).size();
    most_scans = std::max(most_scans, waiting(lidar));
    most_legs = std::max(most_legs, waiting(legs));
  });
  outputs += estimator.finish().size();
  EXPECT_EQ(outputs, 0u);
  EXPECT_LE(most_scans, 40u) << "3 s and what may be late";
  EXPECT_LE(most_legs, 2000u);
  for (const std::size_t s : {legs, lidar}) {
    EXPECT_GT(came[s], 100u);
    EXPECT_EQ(waiting(s), 0u) << "all of it is accounted for";
  }
  for (const char* said : {"legs: 5500 messages could not be used: no IMU", "lidar: 110 messages could not be used: no IMU"})
    EXPECT_THAT(warnings_of(estimator.statistics()), testing::Contains(said));
}

}  // namespace senses_test
}  // namespace kilvo
