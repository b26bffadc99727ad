#include "kilvo/lidar/own_body.hpp"

#include <gtest/gtest.h>
#include <random>

#include "kilvo/lidar/undistort.hpp"

namespace kilvo {
namespace own_body_test {

LidarPoint point_at(const Eigen::Vector3d& x) {
  return {static_cast<float>(x.x()), static_cast<float>(x.y()), static_cast<float>(x.z()), 0, 0};
}

// A robot with two forearms that swing, which passes a pillar at 0.5 m, and then walks for `beside` m beside a wall at 0.6 m.
class Walk {
 public:
  explicit Walk(OwnBody& body) : body_(body) {}

  void forward(double length, double step, bool wall = false) {
    for (double way = 0; way < length; way += step) {
      x_ += step;
      body_.begin_sweep();
      std::normal_distribution<double> swing(0, 0.02);
      for (const double side : {-1.0, 1.0})
        for (int i = 0; i < 20; ++i) see({0.35 + 0.01 * i + swing(random_), side * 0.3 + swing(random_), -0.25 + swing(random_)}, is_arm_);
      for (int i = 0; i < 20; ++i) see({5 - x_, 0.5, -0.5 + 0.05 * i}, is_pillar_);
      for (int i = 0; wall && i < 40; ++i) see({-0.4 + 0.02 * i, -0.6, 0.2}, is_wall_);
      body_.learn({SO3(), {x_, 0, 0}});
    }
  }

  struct Share {
    int dropped = 0, of = 0;
    double value() const { return of == 0 ? 0 : static_cast<double>(dropped) / of; }
  };
  // Since the last call.
  double arms() { return std::exchange(is_arm_, {}).value(); }
  double pillar() { return std::exchange(is_pillar_, {}).value(); }
  double wall() { return std::exchange(is_wall_, {}).value(); }

 private:
  void see(const Eigen::Vector3d& x, Share& share) {
    ++share.of;
    share.dropped += x.norm() < body_.reach() && body_.meets(point_at(x)) ? 1 : 0;
  }

  OwnBody& body_;
  std::mt19937 random_{1};
  double x_ = 0;
  Share is_arm_, is_pillar_, is_wall_;
};

TEST(OwnBody, WhatGoesAlongWithTheRobotIsTheRobot) {
  OwnBody body;
  Walk walk(body);
  walk.forward(2, 0.08);
  walk.arms();
  walk.forward(6, 0.08);
  EXPECT_GT(walk.arms(), 0.98);
  EXPECT_EQ(walk.pillar(), 0) << "it was passed at half a metre";
}

TEST(OwnBody, OfARobotThatStandsNothingIsLearnt) {
  OwnBody body;
  Walk walk(body);
  walk.forward(0.09, 0.0003);
  EXPECT_EQ(walk.arms(), 0);
}

TEST(OwnBody, NorOfOneThatSways) {
  OwnBody body;
  for (int k = 0; k < 100; ++k) {
    body.begin_sweep();
    EXPECT_FALSE(body.meets(point_at({0.5, 0, 0.1})));
    body.learn({SO3(), {0, k % 2 == 0 ? 0.06 : -0.06, 0}});
  }
}

TEST(OwnBody, AWallBesideTheWayIsForgottenWhereItEnds) {
  OwnBody body;
  Walk walk(body);
  walk.forward(6, 0.12, true);
  EXPECT_GT(walk.wall(), 0.5) << "it looks like the robot, and other points than the nearest show it";
  walk.forward(6, 0.12, false);
  walk.wall();
  walk.forward(0.5, 0.12, true);
  EXPECT_EQ(walk.wall(), 0);
}

TEST(OwnBody, BoxesAreTheRobotFromTheBeginningAndAtAnyDistance) {
  OwnBody body({-1.2, -0.2, -0.3, -0.9, 0.2, 0.3, 0.1, 0.1, 0.1, 0.2, 0.2, 0.2});
  EXPECT_NEAR(body.reach(), std::sqrt(1.2 * 1.2 + 0.2 * 0.2 + 0.3 * 0.3), 1e-6);
  EXPECT_TRUE(body.meets(point_at({-1, 0, 0})));
  EXPECT_TRUE(body.meets(point_at({0.15, 0.15, 0.15})));
  EXPECT_FALSE(body.meets(point_at({-1, 0.25, 0})));
  EXPECT_FALSE(body.meets(point_at({0.25, 0.15, 0.15})));
}

TEST(OwnBody, ItsPointsAreDroppedAndCounted) {
  Trajectory trajectory(std::chrono::seconds(1));
  trajectory.push(Time{}, SE3(), Eigen::Vector3d::Zero());
  trajectory.push(Time{} + std::chrono::milliseconds(100), SE3(), Eigen::Vector3d::Zero());
  LidarScan scan;
  for (int i = 0; i < 12; ++i) scan.points.push_back({i == 5 ? 0.5F : 3.0F, 0, 0, 1, 1'000'000 * i});
  OwnBody body({0.4, -0.1, -0.1, 0.6, 0.1, 0.1});
  PointDrops drops;
  const auto points = undistort(scan, trajectory, Time{}, LidarMount{}, drops, &body);
  EXPECT_EQ(points.size(), 11U);
  EXPECT_EQ(drops.own_body, 1U);
  for (const PointXYZI& p : points) EXPECT_EQ(p.x(), 3);
}

}  // namespace own_body_test
}  // namespace kilvo
