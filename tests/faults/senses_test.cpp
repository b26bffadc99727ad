// What the senses say of each other: wrong mounts, wrong stamps, samples at the end of a range, a world that changed.
#include <cstdio>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <memory>

#include "tests/faults/failing_walk.hpp"

namespace kilvo {
namespace {

using lab::Failure;
using lab::FailureKind;
using test::Changes;
using test::FailingWalk;
using test::Moment;
using test::Outcome;

constexpr std::array<bool, sensor_count> li = {true, false, true, false}, ki = {true, true, false, false}, kil = {true, true, true, false},
                                         liv = {true, false, true, true};

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
  static bool has(const Outcome& o, Reason r) {
    return std::ranges::any_of(o.statistics.events, [r](const Event& e) { return e.reason == r; });
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
  EXPECT_LT(epochs[0].first, 0.03);
  EXPECT_LT(epochs[1].first, 0.03);
  EXPECT_LT(epochs[1].second, 2.0) << "the stamps are those of the recording";
}

// All sensors are covered for three seconds, and their clocks stand still: the robot is somewhere else at once.
TEST_F(Senses, ARobotThatWasCarriedAwayDoesNotSayThatItKnowsWhere) {
  const auto carried = [](Measurement& m, double s) {
    if (s >= 5 && s < 9) return false;
    if (s >= 9) std::visit([](auto& x) { x.t -= std::chrono::seconds(4); }, m);
    return true;
  };
  const Outcome o = walk_->with({}, {li, carried, {}});
  std::printf("carried: begun anew %d, sigma %.2f m\n", static_cast<int>(o.statistics.maps_begun_anew), o.worst(&Moment::sigma, 8.5, 10));
  ASSERT_GT(o.statistics.maps_begun_anew, 0u);
  EXPECT_GT(o.worst(&Moment::sigma, 8.5, 10), 3.0);
  EXPECT_TRUE(o.statistics.diverged);
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
  const Outcome cut = FailingWalk("room", 4, 10, false, 12).with({}, {{}, {}, [](Robot& r) { r.imu.accel_range = 12; }});
  const std::uint64_t clipped = cut.statistics.health[0].clipped;
  std::printf("%d samples clipped: rms %.2f mm, %.2f mm without\n", static_cast<int>(clipped), 1e3 * cut.rms_error(),
              1e3 * whole.rms_error());
  EXPECT_GT(clipped, 5u);
  EXPECT_EQ(searches(cut), 0u);
  EXPECT_LT(cut.rms_error(), 1.5 * whole.rms_error());
}

}  // namespace
}  // namespace kilvo
