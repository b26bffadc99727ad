#include "lab/messages/repeated_points.hpp"

#include <gtest/gtest.h>
#include <random>

namespace kilvo::lab {
namespace repeated_points_test {

constexpr std::size_t points = 5000;
constexpr std::int32_t interval = 100'000'000;  // ns

/// The k-th scan of a LiDAR: each measures other points, some rays are without an echo.
std::vector<LidarPoint> scan_of(int k) {
  std::mt19937 random(static_cast<unsigned>(k));
  std::uniform_real_distribution<float> place(-10, 10);
  std::vector<LidarPoint> out;
  for (std::size_t i = 0; i < points; ++i) {
    const auto offset = static_cast<std::int32_t>(static_cast<std::int64_t>(interval) * static_cast<std::int64_t>(i) / points);
    out.push_back(i % 10 == 0 ? LidarPoint{0, 0, 0, 0, offset} : LidarPoint{place(random), place(random), place(random), 1, offset});
  }
  return out;
}

/// The k-th message of a driver that publishes the last so many scans, with the stamp of the last.
LidarScan message(int k, int scans) {
  LidarScan out{Time{} + std::chrono::seconds(1'700'000'000) + Duration(interval) * k, {}};
  for (int back = scans - 1; back >= 0; --back) {
    for (LidarPoint p : scan_of(k - back)) {
      p.offset_ns -= interval * back;
      out.points.push_back(p);
    }
  }
  return out;
}

TEST(RepeatedPoints, OfScansThatAccumulateTheNewOnesAreLeft) {
  for (const int scans : {2, 3, 5}) {
    RepeatedPoints repeated;
    LidarScan first = message(10, scans);
    EXPECT_EQ(repeated.take_out(first), 0U);
    for (int k = 11; k < 15; ++k) {
      LidarScan scan = message(k, scans);
      EXPECT_EQ(repeated.take_out(scan), points * static_cast<std::size_t>(scans - 1));
      EXPECT_EQ(scan.points.size(), points);
      EXPECT_EQ(offsets_of(scan).first, 0);
    }
  }
}

TEST(RepeatedPoints, AfterALostMessageNothingIsLost) {
  RepeatedPoints repeated;
  LidarScan first = message(10, 5), next = message(12, 5);
  repeated.take_out(first);
  EXPECT_EQ(repeated.take_out(next), 3 * points);
  EXPECT_EQ(next.points.size(), 2 * points);
}

TEST(RepeatedPoints, ScansOfTheirOwnAreLeftAlone) {
  RepeatedPoints repeated;
  for (int k = 10; k < 15; ++k) {
    LidarScan scan = message(k, 1);
    scan.points.front().offset_ns = -interval;  // they may overlap in time
    EXPECT_EQ(repeated.take_out(scan), 0U);
    EXPECT_EQ(scan.points.size(), points);
  }
}

// A simulated LiDAR without noise on a robot that stands.
TEST(RepeatedPoints, TheSamePlacesMeasuredAgainAreLeftAlone) {
  RepeatedPoints repeated;
  for (int k = 0; k < 3; ++k) {
    LidarScan scan = message(10, 1);
    scan.t += Duration(interval) * k;
    EXPECT_EQ(repeated.take_out(scan), 0U);
  }
}

// A driver that puts rays without an echo at one place, which is compared. Pairs of them would be 10^10.
TEST(RepeatedPoints, ManyPointsAtOnePlaceAreNoWork) {
  for (int place = 1; place <= 64; ++place) {
    RepeatedPoints repeated;
    for (int k = 0; k < 2; ++k) {
      LidarScan scan{Time{} + std::chrono::seconds(1'700'000'000 + k), {}};
      scan.points.assign(100'000, LidarPoint{0.01F * static_cast<float>(place), 0, 0, 0, 0});
      EXPECT_EQ(repeated.take_out(scan), 0U);
    }
  }
}

TEST(RepeatedPoints, AMessageThatComesTwiceIsEmptyThen) {
  RepeatedPoints repeated;
  LidarScan first = message(10, 1), again = first;
  repeated.take_out(first);
  EXPECT_EQ(repeated.take_out(again), points);
  EXPECT_TRUE(again.points.empty());
}

}  // namespace repeated_points_test
}  // namespace kilvo::lab
