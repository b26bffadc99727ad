// A walk as a function of time: where pelvis, torso and feet are, and what the joints do. Exact and smooth at every time, so that what an
// accelerometer would feel follows from it.
#pragma once

#include <array>
#include <vector>

#include "lab/simulation/footsteps.hpp"
#include "lab/simulation/smooth.hpp"

namespace kilvo::lab {

using JointAngles = std::array<double, 2 * leg_joint_count + 1>;  // rad, in the order of joint_names()

class Walk {
 public:
  /// Throws PlanError when a leg cannot reach, a joint would leave its limits or a swinging foot would hit the ground.
  Walk(const BipedShape& shape, const Ground& ground, const Place& start, const std::vector<Stage>& stages);

  /// When the last stage ends; from then on the robot stands. Seconds from the walk's beginning, as all times here.
  double end() const { return plan_.end; }

  /// Poses in the world (z up).
  SE3 pelvis(double t) const;
  SE3 torso(double t) const { return pelvis(t) * pelvis_torso(t); }
  SE3 imu(double t) const { return torso(t) * T_torso_imu_; }
  /// The foot link (ankle).
  SE3 foot(Side side, double t) const;
  bool in_contact(Side side, double t) const;

  /// Of the IMU, in the world, m/s and m/s^2 (without gravity).
  Eigen::Vector3d velocity(double t) const;
  Eigen::Vector3d acceleration(double t) const;
  /// Of the IMU, in its own frame, rad/s.
  Eigen::Vector3d angular_rate(double t) const;

  JointAngles joints(double t) const;
  JointAngles joint_velocities(double t) const;  // rad/s

  const BipedShape& shape() const { return shape_; }
  const Footsteps& plan() const { return plan_; }

 private:
  static constexpr int channels = 11;
  using Base = SmoothCurve<channels>;

  Base::Point raw_base(double t) const;
  void add_impacts();
  void check(const Ground& ground) const;
  void check_at(const Ground& ground, Side side, double t) const;
  SE3 pelvis_torso(double t) const;
  LegSolution leg(Side side, double t) const;
  std::size_t print_at(Side side, double t) const;
  Eigen::Vector2d ringing(double t) const;

  struct Impact {
    double t, strength;  // s, m/s^2
  };

  BipedShape shape_;
  SE3 T_torso_imu_;
  Footsteps plan_;
  Base base_;
  std::vector<Impact> impacts_;
};

}  // namespace kilvo::lab
