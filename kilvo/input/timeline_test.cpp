#include "kilvo/input/timeline.hpp"

#include <cmath>
#include <gtest/gtest.h>

namespace kilvo {
namespace timeline_test {

constexpr std::array<bool, sensor_count> with_lidar = {true, false, true, false};

ImuSample imu_sample(double s) {
  ImuSample m;
  m.t = time_from_ns(0) + from_seconds(s);
  return m;
}

LidarScan scan_from(double s, double length) {
  LidarScan m;
  m.t = time_from_ns(0) + from_seconds(s);
  m.points.resize(2);
  m.points[1].offset_ns = static_cast<std::int32_t>(length * 1e9);
  return m;
}

// Why something was refused when `m` came.
std::optional<Reason> pushed(Timeline& timeline, Measurement m) {
  timeline.push(std::move(m));
  const auto refused = timeline.take_refused();
  return refused.empty() ? std::nullopt : std::optional(refused.back().reason);
}

std::vector<double> all_from(Timeline& timeline) {
  std::vector<double> out;
  // To a microsecond, so that decimals compare.
  while (auto m = timeline.pop()) out.push_back(std::round(1e6 * to_seconds(completion_of(*m).time_since_epoch())) / 1e6);
  return out;
}

TEST(Timeline, AScanIsCompleteAtItsLastPointWhateverTheirOrder) {
  LidarScan scan = scan_from(1.0, 0.1);
  std::swap(scan.points[0], scan.points[1]);
  EXPECT_EQ(completion_of(scan), time_from_ns(1'100'000'000));
  EXPECT_EQ(begin_of(scan), time_from_ns(1'000'000'000));
}

TEST(Timeline, ReleasesInOrderOfCompletionOnceBothSensorsAreBeyond) {
  Timeline timeline(with_lidar, from_seconds(10));
  EXPECT_FALSE(pushed(timeline, imu_sample(1.000)));
  EXPECT_FALSE(pushed(timeline, imu_sample(1.095)));
  EXPECT_TRUE(all_from(timeline).empty()) << "the LiDAR has not been heard";
  EXPECT_FALSE(pushed(timeline, scan_from(0.99, 0.1)));
  EXPECT_EQ(all_from(timeline), (std::vector<double>{1.0, 1.09})) << "nothing is known of the LiDAR beyond 1.09";
  EXPECT_FALSE(pushed(timeline, scan_from(1.09, 0.1)));
  EXPECT_EQ(all_from(timeline), (std::vector<double>{1.095}));
}

TEST(Timeline, NothingWaitsForAScanThatCannotBeCompleteYet) {
  Timeline timeline(with_lidar, from_seconds(10));
  for (const double begin : {0.8, 0.9}) EXPECT_FALSE(pushed(timeline, scan_from(begin, 0.1)));
  for (const double s : {0.95, 1.0, 1.06, 1.08}) EXPECT_FALSE(pushed(timeline, imu_sample(s)));
  EXPECT_EQ(all_from(timeline), (std::vector<double>{0.9, 0.95, 1.0, 1.0, 1.06})) << "the next scan may be complete from 1.07 on";
}

TEST(Timeline, NothingWaitsForImagesThatNeedNotBeWaitedFor) {
  for (const bool wait : {true, false}) {
    Timeline timeline({true, false, true, true}, from_seconds(10), wait);
    CameraImage image;
    for (const double s : {0.84, 0.94}) {
      image.t = time_from_ns(0) + from_seconds(s);
      EXPECT_FALSE(pushed(timeline, image));
    }
    EXPECT_FALSE(pushed(timeline, scan_from(1.0, 0.1)));
    EXPECT_FALSE(pushed(timeline, imu_sample(1.11)));
    EXPECT_EQ(all_from(timeline), wait ? (std::vector<double>{0.84, 0.94}) : (std::vector<double>{0.84, 0.94, 1.1}));
  }
}

TEST(Timeline, ALateScanOrImageGoesNext) {
  CameraImage image;
  image.t = time_from_ns(0) + from_seconds(0.9);
  Timeline timeline({true, false, false, true}, from_seconds(0.2), false);
  for (const double s : {0.8, 1.0}) EXPECT_FALSE(pushed(timeline, imu_sample(s)));
  EXPECT_EQ(all_from(timeline).size(), 2u);
  EXPECT_FALSE(pushed(timeline, image));
  EXPECT_EQ(all_from(timeline), (std::vector<double>{0.9}));
  EXPECT_EQ(pushed(timeline, imu_sample(0.99)), Reason::late);
  image.t -= from_seconds(0.2);
  EXPECT_EQ(pushed(timeline, image), Reason::late);
}

TEST(Timeline, WaitsForASilentSensorNoLongerThanMaxWait) {
  Timeline timeline(with_lidar, from_seconds(0.2));
  for (int i = 0; i <= 30; ++i) EXPECT_FALSE(pushed(timeline, imu_sample(1.0 + 0.01 * i)));
  const auto released = all_from(timeline);
  ASSERT_EQ(released.size(), 11u);
  EXPECT_DOUBLE_EQ(released.back(), 1.1);
}

TEST(Timeline, DoesNotWaitForASensorThatHasBeenSilentForLong) {
  Timeline timeline(with_lidar, from_seconds(0.2));
  for (int i = 0; i <= 5; ++i) EXPECT_FALSE(pushed(timeline, scan_from(1.0 + 0.1 * i, 0)));
  for (int i = 0; i <= 60; ++i) {
    EXPECT_FALSE(pushed(timeline, imu_sample(1.3 + 0.01 * i)));
    all_from(timeline);
  }
  // Silent for more than three periods: the newest sample goes at once.
  EXPECT_FALSE(pushed(timeline, imu_sample(1.91)));
  ASSERT_TRUE(timeline.pop());
  EXPECT_FALSE(timeline.pop());
}

TEST(Timeline, SortsSwappedNeighbours) {
  Timeline timeline({true, false, false, false}, from_seconds(0.2));
  pushed(timeline, imu_sample(1.0));
  Timeline waiting(with_lidar, from_seconds(0.2));
  for (const double s : {1.0, 1.02, 1.01, 1.03}) EXPECT_FALSE(pushed(waiting, imu_sample(s)));
  waiting.end();
  EXPECT_EQ(all_from(waiting), (std::vector<double>{1.0, 1.01, 1.02, 1.03}));
}

TEST(Timeline, RefusesDuplicatesAndWhatIsOlderThanWhatIsOut) {
  Timeline timeline({true, false, false, false}, from_seconds(0.2));
  EXPECT_FALSE(pushed(timeline, imu_sample(1.0)));
  EXPECT_EQ(pushed(timeline, imu_sample(1.0)), Reason::duplicate);
  EXPECT_EQ(all_from(timeline).size(), 1u);
  EXPECT_EQ(pushed(timeline, imu_sample(0.5)), Reason::late);
}

TEST(Timeline, OneStampFarAheadIsDroppedAndHurtsNobody) {
  Timeline timeline({true, false, false, false}, from_seconds(0.2));
  EXPECT_FALSE(pushed(timeline, imu_sample(1.0)));
  EXPECT_FALSE(pushed(timeline, imu_sample(3601.0)));
  timeline.push(imu_sample(1.005));
  const auto refused = timeline.take_refused();
  ASSERT_EQ(refused.size(), 1u);
  EXPECT_EQ(refused[0].sensor, Sensor::imu);
  EXPECT_EQ(refused[0].reason, Reason::time_jump);
  const auto released = all_from(timeline);
  ASSERT_EQ(released.size(), 2u);
  EXPECT_NEAR(released[1], 1.005, 1e-9);
}

TEST(Timeline, ARecordingThatWasPausedGoesOnWithoutALoss) {
  Timeline timeline({true, false, false, false}, from_seconds(0.2));
  EXPECT_FALSE(pushed(timeline, imu_sample(1.0)));
  for (int i = 0; i < 12; ++i) EXPECT_FALSE(pushed(timeline, imu_sample(60.0 + 0.005 * i)));
  EXPECT_EQ(all_from(timeline).size(), 13u);
  EXPECT_TRUE(timeline.take_refused().empty());
}

JointSample legs_at(double s) {
  JointSample m;
  m.t = time_from_ns(0) + from_seconds(s);
  return m;
}

constexpr std::array<bool, sensor_count> imu_and_legs = {true, true, false, false};

// How long an IMU sample has waited at the most between two times: what arrives is IMU at 200 Hz, and what `legs` says at 1 kHz.
template <class Legs>
double longest_wait(double from, double until, int& late, Legs&& legs) {
  Timeline timeline(imu_and_legs, from_seconds(0.2));
  double longest = 0;
  for (int ms = 0; ms < 1000 * until; ++ms) {
    const double s = 1e-3 * ms;
    if (ms % 5 == 0) {
      EXPECT_FALSE(pushed(timeline, imu_sample(s)));
    }
    if (const std::optional<double> stamp = legs(s)) late += pushed(timeline, legs_at(*stamp)) ? 1 : 0;
    while (auto m = timeline.pop()) {
      if (s > from && std::holds_alternative<ImuSample>(*m)) longest = std::max(longest, s - to_seconds(stamp_of(*m).time_since_epoch()));
    }
  }
  return longest;
}

TEST(Timeline, LegsThatAreLostOrWereNeverThereKeepNobodyWaiting) {
  int late = 0;
  EXPECT_LT(longest_wait(2, 4, late, [](double) { return std::optional<double>(); }), 0.006) << "never there";
  EXPECT_LT(longest_wait(2.2, 4, late, [](double s) { return s < 2 ? std::optional(s) : std::nullopt; }), 0.006) << "lost at 2 s";
  EXPECT_EQ(late, 0);
}

TEST(Timeline, LegsThatComeLateOrAgainAreWaitedFor) {
  int late = 0;
  longest_wait(0, 4, late, [](double s) { return s > 0.15 ? std::optional(s - 0.15) : std::nullopt; });
  EXPECT_EQ(late, 0) << "always 150 ms late";
  longest_wait(0, 6, late, [](double s) { return s < 2 || s > 4 ? std::optional(s - 0.02) : std::nullopt; });
  EXPECT_LE(late, 21) << "away for 2 s: what was measured before the IMU that has gone out already";
}

TEST(Timeline, WithoutTheImuNoSensorFillsTheMemory) {
  constexpr std::size_t megabyte = std::size_t{1} << 20;
  Timeline timeline({true, false, true, true}, from_seconds(0.2));
  EXPECT_FALSE(pushed(timeline, imu_sample(0)));
  std::size_t waiting = 0, most = 0, scans = 0, given_up = 0;
  for (int i = 0; i < 400; ++i) {
    CameraImage image;
    image.t = time_from_ns(0) + from_seconds(0.01 + 0.05 * i);
    image.image.pixels.resize(2 * megabyte);
    timeline.push(std::move(image));
    if (i % 2 == 0) timeline.push(scan_from(0.05 * i, 0.1));
    scans += i % 2 == 0 ? 1 : 0;
    ++waiting;
    for (const Refusal& refused : timeline.take_refused()) {
      EXPECT_EQ(refused.reason, Reason::no_imu);
      waiting -= refused.sensor == Sensor::camera ? 1 : 0;
      scans -= refused.sensor == Sensor::lidar ? 1 : 0;
      ++given_up;
    }
    while (timeline.pop()) {
    }
    most = std::max(most, waiting);
  }
  EXPECT_LE(most, 33u) << "of 2 MB each";
  EXPECT_LE(scans, 32u) << "of 3 s";
  EXPECT_GT(given_up, 400u);
}

}  // namespace timeline_test
}  // namespace kilvo
