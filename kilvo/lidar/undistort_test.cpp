#include "kilvo/lidar/undistort.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <limits>

#include "lab/simulation/analytic_room.hpp"
#include "tests/helpers/random.hpp"

namespace kilvo {
namespace undistort_test {

constexpr Duration scan_time = std::chrono::milliseconds(100);

lab::AnalyticRoomConfig exact_and_awake() {
  lab::AnalyticRoomConfig config;
  config.still = -2;  // at full motion from the start
  config.range_noise = config.angle_noise = 0;
  config.duration = 1;
  config.points_per_scan = 5000;
  return config;
}

LidarMount mount_of(const lab::AnalyticRoomConfig& config) {
  LidarMount mount;
  mount.T_imu_lidar = config.T_imu_lidar;
  return mount;
}

Trajectory true_trajectory(const lab::AnalyticRoom& room, Time first, Time last) {
  Trajectory trajectory(std::chrono::seconds(10));
  for (Time t = first; t <= last; t += std::chrono::milliseconds(5)) trajectory.push(t, room.truth(t), room.velocity(t));
  return trajectory;
}

LidarScan next_scan(lab::AnalyticRoom& room, Time not_before) {
  while (auto m = room.next()) {
    if (auto* scan = std::get_if<LidarScan>(&*m); scan != nullptr && scan->t >= not_before) return *scan;
  }
  return {};
}

double distance_to_surfaces(const lab::AnalyticRoom& room, const Eigen::Vector3d& x) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const lab::Rectangle& r : room.surfaces()) {
    const Eigen::Vector3d d = x - r.corner;
    const double a = std::clamp(d.dot(r.u) / r.u.squaredNorm(), 0.0, 1.0), b = std::clamp(d.dot(r.v) / r.v.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (d - a * r.u - b * r.v).norm());
  }
  return nearest;
}

double farthest_from_surfaces(const lab::AnalyticRoom& room, const std::vector<PointXYZI>& points_I, const SE3& T_RI) {
  double worst = 0;
  for (const PointXYZI& p : points_I) worst = std::max(worst, distance_to_surfaces(room, T_RI * p.head<3>().cast<double>()));
  return worst;
}

TEST(Undistort, OnTheMoveEveryPointLandsOnItsSurface) {
  const auto config = exact_and_awake();
  lab::AnalyticRoom room(config);
  const LidarScan scan = next_scan(room, room.start() + std::chrono::milliseconds(300));
  const Trajectory trajectory = true_trajectory(room, room.start(), room.start() + std::chrono::seconds(1));
  for (const Time at : {scan.t, scan.t + scan_time / 2, scan.t + scan_time}) {
    PointDrops drops;
    const auto points = undistort(scan, trajectory, at, mount_of(config), drops);
    EXPECT_EQ(points.size(), scan.points.size());
    EXPECT_LT(farthest_from_surfaces(room, points, room.truth(at)), 2e-4);
    EXPECT_EQ(drops.non_finite + drops.at_origin + drops.too_near + drops.too_far + drops.outside_trajectory, 0U);
  }
  // It matters: held at one pose they would not.
  Trajectory still(std::chrono::seconds(10));
  still.push(room.start(), room.truth(scan.t), {0, 0, 0});
  still.push(room.start() + std::chrono::seconds(1), room.truth(scan.t), {0, 0, 0});
  PointDrops drops;
  EXPECT_GT(farthest_from_surfaces(room, undistort(scan, still, scan.t, mount_of(config), drops), room.truth(scan.t)), 0.02);
}

TEST(Undistort, UnsortedPointsAreTheSamePoints) {
  const auto config = exact_and_awake();
  lab::AnalyticRoom room(config);
  LidarScan scan = next_scan(room, room.start() + std::chrono::milliseconds(300));
  const Trajectory trajectory = true_trajectory(room, room.start(), room.start() + std::chrono::seconds(1));
  PointDrops drops;
  const auto sorted = undistort(scan, trajectory, scan.t, mount_of(config), drops);
  std::reverse(scan.points.begin(), scan.points.end());
  auto reversed = undistort(scan, trajectory, scan.t, mount_of(config), drops);
  std::reverse(reversed.begin(), reversed.end());
  EXPECT_EQ(sorted, reversed);
}

TEST(Undistort, ACorrectionWithinTheScanIsNoMotion) {
  const auto config = exact_and_awake();
  lab::AnalyticRoom room(config);
  const LidarScan scan = next_scan(room, room.start() + std::chrono::milliseconds(300));
  const Time middle = scan.t + scan_time / 2 + std::chrono::milliseconds(1), end = scan.t + scan_time;
  const SE3 C{SO3::Exp({0.001, -0.002, 0.002}), {0.003, 0.004, 0}};
  Trajectory trajectory = true_trajectory(room, room.start(), middle);
  trajectory.push(middle, room.truth(middle), room.velocity(middle));
  trajectory.correct(middle, C * room.truth(middle), {0, 0, 0});
  for (Time t = middle + std::chrono::milliseconds(4); t <= end + std::chrono::milliseconds(5); t += std::chrono::milliseconds(5)) {
    trajectory.push(t, C * room.truth(t), C.R * room.velocity(t));
  }
  PointDrops drops;
  const auto points = undistort(scan, trajectory, end, mount_of(config), drops);
  EXPECT_EQ(points.size(), scan.points.size());
  EXPECT_LT(farthest_from_surfaces(room, points, room.truth(end)), 2e-4);
}

Trajectory at_rest() {
  Trajectory trajectory(std::chrono::seconds(10));
  for (int ms = 0; ms <= 1000; ms += 5) trajectory.push(time_from_ns(0) + std::chrono::milliseconds(ms), SE3{}, {0, 0, 0});
  return trajectory;
}

TEST(Undistort, WhatIsNoPointIsDroppedAndCountedByCause) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  LidarScan scan;
  scan.t = time_from_ns(500'000'000);
  scan.points = {{1, 2, 3, 4, 0},
                 {nan, 2, 3, 4, 0},
                 {1, nan, 3, 4, 0},
                 {1, 2, inf, 4, 0},
                 {-inf, 2, 3, 4, 0},
                 {1, 2, 3, nan, 0},
                 {0, 0, 0, 4, 0},
                 {0, 0, 0, 0, 0},
                 {0.1F, 0.1F, 0, 4, 0},
                 {99, 99, 0, 4, 0},
                 {1e30F, 1e30F, 0, 4, 0},  // its square is infinite
                 {1, 2, 3, 4, 1'000'000'000},
                 {1, 2, 3, 4, -1'000'000'000},
                 {4, 5, 6, 7, 500'000'000}};
  PointDrops drops;
  const auto points = undistort(scan, at_rest(), scan.t, LidarMount{}, drops);
  ASSERT_EQ(points.size(), 3U);
  EXPECT_EQ(points[0], PointXYZI(1, 2, 3, 4));
  EXPECT_EQ(points[1], PointXYZI(1, 2, 3, 0)) << "a place without an intensity";
  EXPECT_EQ(points[2], PointXYZI(4, 5, 6, 7));
  EXPECT_EQ(drops.non_finite, 5U);
  EXPECT_EQ(drops.at_origin, 2U);
  EXPECT_EQ(drops.too_near, 1U);
  EXPECT_EQ(drops.too_far, 1U);
  EXPECT_EQ(drops.outside_trajectory, 2U);
}

TEST(Undistort, APointJustOutsideTheTrajectoryTakesItsEnd) {
  LidarScan scan;
  scan.t = time_from_ns(1'000'000'000);
  scan.points = {{1, 2, 3, 4, 4'000'000}, {1, 2, 3, 4, 6'000'000}};
  PointDrops drops;
  EXPECT_EQ(undistort(scan, at_rest(), scan.t, LidarMount{}, drops).size(), 1U);
  EXPECT_EQ(drops.outside_trajectory, 1U);
}

TEST(Undistort, WithoutPointsOrWithoutAPoseNothingComesOut) {
  PointDrops drops;
  EXPECT_TRUE(undistort(LidarScan{time_from_ns(500'000'000), {}}, at_rest(), time_from_ns(500'000'000), LidarMount{}, drops).empty());
  EXPECT_EQ(drops.outside_trajectory, 0U);
  const LidarScan scan{time_from_ns(500'000'000), {{1, 2, 3, 4, 0}, {1, 2, 3, 4, 1}}};
  EXPECT_TRUE(undistort(scan, at_rest(), time_from_ns(-1), LidarMount{}, drops).empty());
  EXPECT_TRUE(undistort(scan, Trajectory(std::chrono::seconds(1)), scan.t, LidarMount{}, drops).empty());
  LidarScan elsewhere = scan;  // nor takes it time or memory
  elsewhere.t += std::chrono::hours(1);
  EXPECT_TRUE(undistort(elsewhere, at_rest(), scan.t, LidarMount{}, drops).empty());
  EXPECT_EQ(drops.outside_trajectory, 6U);
}

}  // namespace undistort_test
}  // namespace kilvo
