#include "lab/doctor/sole_level.hpp"

#include <cmath>
#include <gtest/gtest.h>

namespace kilvo::lab {
namespace sole_level_test {

using Eigen::Vector3d;

constexpr double seconds = 40;

struct Walk {
  std::vector<LegPose> path;
  std::vector<InertialSample> imu;
};

// Upright, turning at `rate`, on ground whose normal is along `normal_W`, with an IMU whose mount is Exp(turn) on the link; described:
// none.
Walk walk(double rate, const Vector3d& normal_W, const Vector3d& turn) {
  Walk out;
  for (double t = 0; t < seconds; t += 0.01) {
    out.imu.push_back({t, {0, 0, rate}, {0, 0, 9.81}});
    const SO3 R_WI = SO3::Exp(Vector3d(0, 0, rate * t));
    const Vector3d normal = SO3::Exp(turn) * (R_WI.inverse() * normal_W.normalized());
    LegPose pose;
    pose.t = t;
    const bool left = std::fmod(t, 1.0) < 0.5;
    for (std::size_t side = 0; side < 2; ++side) {
      FootPose& foot = pose.foot[side];
      const bool stands = left == (side == 0);
      const Vector3d up = stands ? normal : Vector3d(0.5, 0, 1).normalized();  // one that swings points its toes down
      const Vector3d x = up.unitOrthogonal(), y = up.cross(x), middle(0, side == 0 ? 0.1 : -0.1, stands ? -0.8 : -0.7);
      foot.corners = 4;
      foot.p[0] = middle + 0.1 * x + 0.03 * y;
      foot.p[1] = middle + 0.1 * x - 0.03 * y;
      foot.p[2] = middle - 0.1 * x - 0.03 * y;
      foot.p[3] = middle - 0.1 * x + 0.03 * y;
    }
    out.path.push_back(pose);
  }
  return out;
}

std::optional<SoleLevel> level(const Walk& w) {
  const GyroPath gyro(w.imu, Eigen::Matrix3d::Identity(), Vector3d::Zero());
  return sole_level(w.path, w.imu, gyro, SO3(), 0, [](double) { return true; });
}

TEST(SoleLevel, AMountIsSeenWhereTheRobotTurnsOnASlope) {
  const Vector3d turn(0.03, -0.1, 0), slope(0.08, 0.05, 1);
  const auto found = level(walk(0.4, slope, turn));
  ASSERT_TRUE(found);
  EXPECT_LT((found->turn - turn).norm(), 0.01);
  EXPECT_LT(found->sigma, 0.05);
  EXPECT_GT(found->turn.norm(), 2 * found->sigma);
}

TEST(SoleLevel, StraightUpASlopeNoMountIsKnown) {
  const auto found = level(walk(0, {0.14, 0, 1}, Vector3d::Zero()));
  ASSERT_TRUE(found);
  EXPECT_GT(found->sigma, 0.06) << "rad";
  EXPECT_LT(found->turn.norm(), 2 * found->sigma);
}

TEST(SoleLevel, NothingIsKnownOfAShortWalkAndOfFeetThatArePoints) {
  Walk w = walk(0.4, Vector3d::UnitZ(), {0, 0.1, 0});
  for (LegPose& pose : w.path) pose.foot[0].corners = pose.foot[1].corners = 1;
  EXPECT_FALSE(level(w));
  Walk shorter = walk(0.4, Vector3d::UnitZ(), {0, 0.1, 0});
  shorter.imu.resize(900);
  EXPECT_FALSE(level(shorter));
}

}  // namespace sole_level_test
}  // namespace kilvo::lab
