// Forward kinematics of both legs: from joint encoders to the sole's corner points as the IMU sees them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "kilvo/math/so3.hpp"
#include "kilvo/sensors/measurement.hpp"
#include "kilvo/sensors/robot.hpp"

namespace kilvo {

class LinkTree;

/// Corner points of one sole at most.
inline constexpr int max_corners = 8;

/// One foot relative to the IMU, in the IMU frame.
struct FootPose {
  SO3 R_IF;                                      // h_R(alpha) of Eq. 2
  int corners = 0;                               // points of the sole in use
  std::array<Eigen::Vector3d, max_corners> p{};  // the sole's corner points, m
  std::array<Eigen::Vector3d, max_corners> v{};  // their velocities relative to the IMU, m/s
};

struct Feet {
  Time t{};
  std::array<FootPose, 2> foot;  // left, right
  /// Of the ground on each foot, from the joints' efforts, IMU frame, N; where it is asked for and they are there.
  std::optional<std::array<Eigen::Vector3d, 2>> force_I;
};

/// A point of a sole: a weighted mean of its corners.
struct SolePoint {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  // IMU frame, m
  Eigen::Vector3d v = Eigen::Vector3d::Zero();  // relative to the IMU, m/s
};

/// The point on which a sole stands: corners within about a millimetre of the lowest along `up_I` (unit vector, IMU frame) share it.
SolePoint lowest_point(const FootPose& foot, const Eigen::Vector3d& up_I);

/// How the joints of a robot move its feet. Through all joints between the IMU's link and each foot's link, the waist included.
class LegKinematics {
 public:
  /// Throws std::invalid_argument naming the link or joint when the URDF cannot be used.
  /// `forces`: Feet::force_I is wanted. `tree`: of robot.urdf, where it has been read before.
  explicit LegKinematics(const Robot& robot, bool forces = false, const LinkTree* tree = nullptr);
  LegKinematics(LegKinematics&&) noexcept;
  ~LegKinematics();

  /// The feet, or why they cannot be known: "not finite", "joint NAME is missing", ... Joints are matched by name, in any order; a message
  /// without velocities gets the difference to the one before, so the first only begins it. Allocates only when the names change.
  std::variant<Feet, std::string> feet(const JointSample& sample);

  /// What makes such messages useless for this robot, if anything: a joint neither in them nor locked, joints where two feet are expected.
  std::optional<std::string> mismatch(const JointSample& sample) const;

 private:
  struct Chains;
  std::unique_ptr<Chains> chains_;
};

}  // namespace kilvo
