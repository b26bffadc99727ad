#include "kilvo/input/input_queue.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

namespace kilvo {
namespace input_queue_test {

constexpr std::array<bool, sensor_count> imu_and_lidar = {true, false, true, false};
constexpr Duration max_wait = std::chrono::milliseconds(200);

InputQueue queue() { return {Robot{}, imu_and_lidar, max_wait, true}; }

// Of a sensor with noise: no two are the same.
ImuSample imu_at(double s) {
  ImuSample m;
  m.t = time_from_ns(1'000'000'000'000) + from_seconds(s);
  m.gyro = {std::sin(1e3 * s), 0.1, 0.2};
  m.accel = {std::cos(1e3 * s), 0, 9.8};
  return m;
}

LidarScan scan_at(double s) {
  LidarScan m;
  m.t = time_from_ns(1'000'000'000'000) + from_seconds(s);
  m.points = {{static_cast<float>(s), 1, 1, 1, 0}, {2, static_cast<float>(s), 1, 1, 100'000'000}};
  return m;
}

std::vector<Measurement> popped(InputQueue& q) {
  std::vector<Measurement> out;
  while (auto m = q.pop()) out.push_back(std::move(*m));
  return out;
}

TEST(InputQueue, GivesMeasurementsInTheOrderOfTime) {
  InputQueue q = queue();
  q.push(scan_at(0.01));  // complete at 0.11 s
  for (int i = 0; i < 60; ++i) q.push(imu_at(0.005 * i));
  q.end();
  const auto all = popped(q);
  ASSERT_EQ(all.size(), 61u);
  EXPECT_TRUE(std::ranges::is_sorted(all, {}, completion_of));
  EXPECT_EQ(sensor_of(all[23]), Sensor::lidar) << "after the samples until 0.11 s";
  EXPECT_TRUE(q.take_refused().empty());
}

// Sweeps come between them, twenty at a time arrive late together, forty are missing.
TEST(InputQueue, SamplesOfTheImuThatComeInBurstsOrAfterAGapAreAllLetThrough) {
  for (const int burst : {1, 4, 20}) {
    InputQueue q = queue();
    std::size_t sent = 0;
    for (int i = 0; i < 400; ++i) {
      if (i % burst == 0) {
        for (int k = i; k < i + burst; ++k) {
          if (k >= 200 && k < 240) continue;
          q.push(imu_at(0.005 * k));
          ++sent;
        }
      }
      if (i % 20 == 10) q.push(scan_at(0.005 * i - 0.1)), ++sent;
    }
    q.end();
    EXPECT_EQ(popped(q).size(), sent) << burst;
    EXPECT_TRUE(q.take_refused().empty()) << burst;
  }
}

TEST(InputQueue, OfTheImuOneStampAheadIsRefusedAndTheLastOneToo) {
  InputQueue q = queue();
  for (int i = 0; i < 100; ++i) q.push(imu_at(i == 50 || i == 99 ? 0.005 * i + 0.04 : 0.005 * i));
  q.end();
  EXPECT_EQ(popped(q).size(), 98u);
  const auto refused = q.take_refused();
  ASSERT_EQ(refused.size(), 2u);
  EXPECT_EQ(refused[0].reason, Reason::time_jump);
}

TEST(InputQueue, NamesWhatItRefusesAndLetsTheRestThrough) {
  InputQueue q = queue();
  q.push(imu_at(0));
  q.push(imu_at(0));  // again
  ImuSample broken = imu_at(0.005);
  broken.gyro.x() = NAN;
  q.push(broken);
  ImuSample off = imu_at(0.005);  // it has not begun to measure
  off.gyro = off.accel = Eigen::Vector3d::Zero();
  q.push(off);
  q.push(JointSample{});  // not used
  q.push(LidarScan{});    // empty
  q.push(imu_at(0.005));
  q.end();
  EXPECT_EQ(popped(q).size(), 2u);
  std::vector<Reason> reasons;
  for (const auto& refusal : q.take_refused()) reasons.push_back(refusal.reason);
  EXPECT_EQ(reasons, (std::vector{Reason::duplicate, Reason::not_finite, Reason::all_zero, Reason::not_used, Reason::empty}));
  EXPECT_TRUE(q.take_refused().empty()) << "each is named once";
}

TEST(InputQueue, AShiftedClockMovesTheStampsThatComeThenAndIsBounded) {
  InputQueue q = queue();
  EXPECT_NEAR(q.shift_by(Sensor::lidar, 0.02), 0.02, 1e-9);
  q.push(scan_at(0.01));
  q.end();
  const auto all = popped(q);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(stamp_of(all[0]), scan_at(0.03).t);
  EXPECT_NEAR(q.shift_by(Sensor::lidar, 1.0), 0.2, 1e-9);
}

TEST(InputQueue, ARecordingPlayedAgainIsAnotherEpochThatBeginsWithItsFirstMeasurement) {
  InputQueue q = queue();
  for (int i = 0; i < 2000; ++i) q.push(imu_at(0.005 * i));
  int i = 0;
  for (; i < 100 && !q.time_went_back(); ++i) q.push(imu_at(0.005 * i));
  ASSERT_TRUE(q.time_went_back());
  InputQueue next = q.next_epoch();
  EXPECT_FALSE(next.time_went_back());
  next.push(imu_at(0.005 * i));
  next.end();
  const auto all = popped(next);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(stamp_of(all[1]), imu_at(0.005 * i).t) << "its own stamps";
}

}  // namespace input_queue_test
}  // namespace kilvo
