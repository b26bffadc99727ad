#include "kilvo/vision/mount_check.hpp"

#include <gtest/gtest.h>
#include <random>

namespace kilvo {
namespace {

// What a camera that is turned by psi shows to a robot that looks about.
MountCheck looked_about(const Eigen::Vector3d& psi, double noise, int views, const Eigen::Vector3d& reach) {
  MountCheck check;
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, 1);
  const auto some = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  for (int i = 0; i < views; ++i) {
    const SO3 R_c = SO3::Exp(reach.cwiseProduct(some())), R_r = SO3::Exp(reach.cwiseProduct(some()));
    const Eigen::Vector3d d = (R_c.inverse() * R_r).matrix() * psi - psi + noise * some();
    const Eigen::Matrix3d A = Eigen::Matrix3d::Identity() / (noise * noise);
    check.add(R_c, R_r, A, A * d);
  }
  return check;
}

const Eigen::Vector3d lively(0.1, 0.1, 0.4);

TEST(MountCheck, ACameraTurnedByThreeDegreesIsFound) {
  const Eigen::Vector3d psi(0.03, -0.04, 0.015);
  const auto found = looked_about(psi, 1e-3, 1000, lively).misalignment();
  ASSERT_TRUE(found);
  EXPECT_LT((*found - psi).norm(), 0.005);
}

TEST(MountCheck, ACameraThatIsMountedAsItShouldIsNotSpokenOf) {
  EXPECT_FALSE(looked_about(Eigen::Vector3d::Zero(), 3e-3, 3000, lively).misalignment());
  EXPECT_FALSE(looked_about({0.003, 0, -0.003}, 1e-3, 3000, lively).misalignment());
}

TEST(MountCheck, WhoNeverTurnsLearnsNothing) {
  EXPECT_FALSE(looked_about({0.05, 0.05, 0.05}, 1e-3, 1000, Eigen::Vector3d::Constant(1e-3)).misalignment());
}

}  // namespace
}  // namespace kilvo
