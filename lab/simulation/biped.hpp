// The simulated humanoid: its proportions, its legs' inverse kinematics in closed form, and the URDF that says the same.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "kilvo/math/se3.hpp"

namespace kilvo::lab {

enum class Side : std::uint8_t { left, right };
constexpr std::size_t index_of(Side side) { return side == Side::left ? 0 : 1; }
constexpr double sign_of(Side side) { return side == Side::left ? 1.0 : -1.0; }

inline constexpr int leg_joint_count = 6;
/// Hip pitch, hip roll, hip yaw, knee, ankle pitch, ankle roll; rad.
using LegAngles = std::array<double, leg_joint_count>;

/// About those of a Unitree G1. The three hip axes meet in one point, and so do the two ankle axes: that is what makes the inverse
/// kinematics closed. Pelvis and torso frames: x forward, y left, z up. Metres.
struct BipedShape {
  Eigen::Vector3d hip{0, 0.118, -0.13};  // of the left hip in the pelvis frame
  double thigh = 0.30, shin = 0.30;
  double sole_depth = 0.035;                // from the ankle down to the sole
  double heel = -0.05, toe = 0.12;          // the sole's ends along x of the foot
  double sole_half_width = 0.03;            // along y
  Eigen::Vector3d waist{-0.004, 0, 0.044};  // torso link in the pelvis, waist at zero
  SE3 T_torso_lidar = lidar_mount();        // a Mid-360 hung upside down
  SE3 T_imu_lidar{SO3(), {-0.011, -0.02329, 0.04412}};

  SE3 T_torso_imu() const { return T_torso_lidar * T_imu_lidar.inverse(); }
  Eigen::Vector3d hip_of(Side side) const { return {hip.x(), sign_of(side) * hip.y(), hip.z()}; }
  /// Corner points of the sole in the foot link.
  std::array<Eigen::Vector3d, 4> sole() const;

 private:
  static SE3 lidar_mount();
};

struct JointLimit {
  double lower, upper;  // rad
};
/// Of the leg's joints in their order; those of hip roll are of the left leg, the right one's are mirrored.
const std::array<JointLimit, leg_joint_count>& leg_limits();

/// Joint names: left leg, right leg, waist yaw.
const std::array<std::string, 2 * leg_joint_count + 1>& joint_names();

struct LegSolution {
  LegAngles angles{};
  std::string fault;  // empty, or why the leg cannot do this
};

/// The angles that put the foot link at `T_pelvis_foot`. The knee bends forward.
LegSolution solve_leg(const BipedShape& shape, Side side, const SE3& T_pelvis_foot);

/// The foot link in the pelvis.
SE3 foot_in_pelvis(const BipedShape& shape, Side side, const LegAngles& q);

/// The URDF document.
std::string urdf_of(const BipedShape& shape);

}  // namespace kilvo::lab
