// The shipped robots have legs that the kinematics can use.
#include <array>
#include <filesystem>
#include <gtest/gtest.h>
#include <string>

#include "kilvo/legs/leg_kinematics.hpp"
#include "lab/settings/settings.hpp"

namespace kilvo::lab {
namespace shipped_legs_test {

Robot shipped(const std::string& name) {
  return load_settings(std::filesystem::path(KILVO_SOURCE_DIR) / "config/robots" / (name + ".yaml")).robot;
}

class ShippedG1 : public testing::TestWithParam<const char*> {};

TEST_P(ShippedG1, HasFeetThatAreMirrorImagesAtZeroJoints) {
  const Robot robot = shipped(GetParam());
  LegKinematics legs(robot);
  JointNames::List names;
  for (const char* side : {"left", "right"}) {
    for (const char* joint : {"hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll"}) {
      names.push_back(std::string(side) + "_" + joint + "_joint");
    }
  }
  JointSample s;
  s.names = names;
  s.position.assign(12, 0.0);
  s.velocity.assign(12, 0.0);
  auto known = legs.feet(s);
  ASSERT_TRUE(std::holds_alternative<Feet>(known)) << std::get<std::string>(known);
  const Feet& feet = std::get<Feet>(known);
  constexpr std::array<std::size_t, 4> mirrored = {1, 0, 3, 2};
  for (std::size_t k = 0; k < 4; ++k) {
    // In the pelvis, where left and right are mirror images.
    const Eigen::Vector3d left = robot.imu.T_link_imu * feet.foot[0].p[k], right = robot.imu.T_link_imu * feet.foot[1].p[mirrored[k]];
    EXPECT_LT((left - Eigen::Vector3d(right.x(), -right.y(), right.z())).norm(), 1e-9);
    EXPECT_GT(left.y(), 0.08);
    EXPECT_NEAR(left.z(), -0.79, 0.02);
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, ShippedG1, testing::Values("g1", "g1_cam_r", "g1_tilt", "g1_tilt_cam_r"));

}  // namespace shipped_legs_test
}  // namespace kilvo::lab
