// From "eight steps forward, then turn" to where and when each foot stands.
#pragma once

#include <limits>
#include <stdexcept>
#include <vector>

#include "lab/simulation/ground.hpp"

namespace kilvo::lab {

/// How a stage of the walk is walked. Lengths in m, times in s, speeds in m/s, angles in rad, accelerations in m/s^2.
struct Gait {
  double forward = 0, left = 0, turn = 0;  // what one step adds to where the body is and looks
  double period = 0.55;                    // of one step
  double double_support = 0.12;            // per step; negative: flight
  double lift = 0.06;                      // of the foot in the middle of its swing
  double hip_height = 0.555;               // over the ankles
  double sway = 0.03, bob = 0.012;         // of the pelvis, sideways with the stance foot and up in the middle of each step
  double roll = 0.02, pitch = 0.015, twist = 0.05, lean = 0.03;
  double leaving = 0.3;                 // speed that a foot has soon after it left the ground
  double landing = 0.3;                 // and at which it comes down
  double impact = 4;                    // the torso rings so hard at each touchdown
  double heel_strike = 0, toe_off = 0;  // the sole comes down on its heel, leaves over its toe
  double slip = 0, slip_time = 0.15;    // each stance of the left foot slides forward so far in so long
  double sink = 0, creep = 0;           // each stance sinks and creeps sideways
};

/// Stands, then makes steps. Stages without a stand between them flow into each other.
struct Stage {
  double stand = 0;
  int steps = 0;
  Gait gait{};
};

struct Footprint {
  SE3 sole;                                                 // in the world: the sole's point under the ankle, at touchdown
  double touch = -std::numeric_limits<double>::infinity();  // s
  double lift = std::numeric_limits<double>::infinity();    // s
  Eigen::Vector3d slide = Eigen::Vector3d::Zero();          // while it stands, m
  double slide_begin = 0, slide_time = 1;                   // s, from touch
  double sink = 0;                                          // m, along the normal
  Eigen::Vector3d creep = Eigen::Vector3d::Zero();          // m
  double heel_angle = 0, toe_angle = 0;                     // at touchdown, at lift-off; rad
  double swing_lift = 0;                                    // of the swing that ends here, m
  double swing_leaving = 0, swing_landing = 0;              // its speeds up at its beginning and down at its end, m/s

  /// Displacement of the standing foot t seconds after touchdown, in the world.
  Eigen::Vector3d displacement(double t) const;
};

struct Step {
  double begin = 0, period = 0;
  Side side = Side::left;
  Gait gait{};
};

struct Footsteps {
  std::array<std::vector<Footprint>, 2> prints;  // by Side, in order of time
  std::vector<Step> steps;
  std::vector<Eigen::Vector4d> frames;  // x, y, z, yaw of the body's place on the ground; step k goes from frame k to k + 1
  double end = 0;                       // s, of the last stage
};

struct Place {
  double x = 0, y = 0, yaw = 0;
};

/// A walk that these legs cannot do. The text says when and why.
struct PlanError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Each run of stages is ended by a step that brings the feet side by side. Throws PlanError on numbers that make no walk.
Footsteps plan_footsteps(const BipedShape& shape, const Ground& ground, const Place& start, const std::vector<Stage>& stages);

}  // namespace kilvo::lab
