// What a sole does in the world, seen with a state.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "kilvo/filter/state.hpp"
#include "kilvo/legs/leg_kinematics.hpp"
#include "kilvo/sensors/time.hpp"

namespace kilvo {

/// Velocity in the world of a point that is at p_I and moves by v_I relative to the IMU, m/s. `omega`: bias-free rate, rad/s.
inline Eigen::Vector3d velocity_W(const State& x, const Eigen::Vector3d& p_I, const Eigen::Vector3d& v_I, const Eigen::Vector3d& omega) {
  return x.v + x.R * (omega.cross(p_I) + v_I);
}

/// The point on which a sole stands or would stand: its lowest along the normal of the ground.
struct FootMotion {
  Eigen::Vector3d lowest = Eigen::Vector3d::Zero();    // in the world, m
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // of that point, m/s
  double height = 0;                                   // along the normal, m
  double speed = 0;                                    // m/s, vertical motion counted one and a half times
  double vertical = 0;                                 // upward velocity, m/s
  double rolling = 0;                                  // difference of the velocities of its corners, at the most, m/s
};
/// `up_W`: unit vector against gravity; `normal_W`: of the ground.
FootMotion motion_of(const FootPose& foot, const State& x, const Eigen::Vector3d& omega, const Eigen::Vector3d& up_W,
                     const Eigen::Vector3d& normal_W);

/// Unit normal of a sole, upwards; none when its corners span no area.
std::optional<Eigen::Vector3d> sole_normal(const FootPose& foot, const State& x, const Eigen::Vector3d& up_W);

}  // namespace kilvo
