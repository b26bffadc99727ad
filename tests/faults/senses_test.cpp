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

constexpr std::array<bool, sensor_count> li = {true, false, true, false}, ki = {true, true, false, false};

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
  for (const double ahead : {0.3, 0.6, 0.95}) {
    for (const bool with_legs : {true, false}) {
      const auto stamp = [ahead, n = 0](Measurement& m, double) mutable {
        if (auto* imu = std::get_if<ImuSample>(&m); imu != nullptr && ++n == 1600) imu->t += from_seconds(ahead);
        return true;
      };
      const Outcome o = walk_->with({}, {with_legs ? std::nullopt : std::optional(li), stamp, {}});
      EXPECT_EQ(dropped(o, Sensor::imu), 1u) << ahead;
      EXPECT_EQ(o.statistics.imu_outages, 0u) << ahead;
      EXPECT_LT(o.worst(&Moment::error, 0, 14), 0.01) << ahead;
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
