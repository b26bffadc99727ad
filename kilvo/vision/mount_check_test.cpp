#include "kilvo/vision/mount_check.hpp"

#include <gtest/gtest.h>
#include <random>

namespace kilvo {
namespace mount_check_test {

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
    check.add({R_c, Eigen::Vector3d::Zero()}, {R_r, Eigen::Vector3d::Zero()}, A, A * d);
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

// What a camera whose stamps are `late` shows to a robot that sways.
std::optional<double> offset_found(double late, const Eigen::Vector3d& psi) {
  MountCheck check;
  std::mt19937 random(4);
  std::normal_distribution<double> normal(0, 1);
  const auto some = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  for (int i = 0; i < 2000; ++i) {
    const SO3 R_c = SO3::Exp(lively.cwiseProduct(some())), R_r = SO3::Exp(lively.cwiseProduct(some()));
    const Eigen::Vector3d omega_c = 0.3 * some(), omega_r = 0.3 * some();
    // Each pose was taken that of a later time.
    const SO3 seen_c = R_c * SO3::Exp(-late * omega_c), seen_r = R_r * SO3::Exp(-late * omega_r);
    const Eigen::Vector3d d =
        (R_c.inverse() * R_r * seen_r.inverse() * seen_c).Log() + (R_c.inverse() * R_r).matrix() * psi - psi + 1e-3 * some();
    const Eigen::Matrix3d A = Eigen::Matrix3d::Identity() / 1e-6;
    check.add({R_c, omega_c}, {R_r, omega_r}, A, A * d);
  }
  return check.time_offset(0.002);
}

TEST(MountCheck, AnOffsetOfTheStampsIsFoundBesideATurn) {
  const auto found = offset_found(0.01, {0.01, -0.01, 0});
  ASSERT_TRUE(found);
  EXPECT_LT(*found, -0.009);
  EXPECT_GT(*found, -0.02) << "the half more that is usually lost, no more";
  EXPECT_FALSE(offset_found(0, {0.01, -0.01, 0}));
  EXPECT_FALSE(offset_found(0.001, Eigen::Vector3d::Zero()));
}

TEST(MountCheck, WhoNeverTurnsLearnsNothing) {
  EXPECT_FALSE(looked_about({0.05, 0.05, 0.05}, 1e-3, 1000, Eigen::Vector3d::Constant(1e-3)).misalignment());
}

}  // namespace mount_check_test
}  // namespace kilvo
