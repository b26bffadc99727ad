// Which foot stands on the ground, without force sensors, and how surely (paper, Section V; docs/decisions/contact.md: where this departs).
#pragma once

#include <Eigen/Core>
#include <array>

#include "kilvo/filter/state.hpp"
#include "kilvo/filter/stationarity.hpp"
#include "kilvo/legs/contact_cues.hpp"
#include "kilvo/legs/contact_filter.hpp"
#include "kilvo/legs/foot_motion.hpp"
#include "kilvo/legs/ground.hpp"
#include "kilvo/legs/leg_kinematics.hpp"

namespace kilvo {

/// What is reported of both feet (left, right).
struct Contacts {
  Time t{};
  std::array<bool, 2> on = {true, true};
  std::array<double, 2> probability = {1, 1};         // of standing
  std::array<double, 2> load = {0.5, 0.5};            // share of the weight, while both stand
  bool flight = false;                                // the IMU measures free fall
  std::array<Time, 2> since{};                        // of the present phase of each
  std::array<double, 2> clearance = {0, 0};           // of the lowest point over the ground on which it stood last, m
  double d_a = 0;                                     // normalised deviation of the acceleration
  std::array<double, 2> d_fv = {0, 0};                // normalised deviation of the foot's velocity; above 10: it moves
  std::array<GroundPatch, 2> ground;                  // on which each stands or stood last
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // of the ground under the feet, in the world
  double sole_speed = 0;                              // of a supporting foot as it is seen, median, as learnt, m/s
  double fast_sole = 0;                               // five of six samples of it are slower, m/s
  double swing_speed = 0;                             // of a foot that swings, median, as learnt, m/s; 0: not known

  /// How long a foot has been on or off, s.
  double phase(std::size_t side) const { return to_seconds(t - since[side]); }
};

class ContactEstimator {
 public:
  /// `x`: the state at feet.t. `omega`, `accel`: bias-free rate (rad/s) and specific force (m/s^2) of the IMU. `sigma_v`: uncertainty of
  /// the state's velocity, m/s. `map`: where the ground is looked up, if there is one.
  const Contacts& update(const Feet& feet, const State& x, const Eigen::Vector3d& omega, const Eigen::Vector3d& accel, double sigma_v = 0,
                         const VoxelMap* map = nullptr);

  const Contacts& contacts() const { return contacts_; }

  /// Forgets the feet, not the robot: after a gap in the legs' messages.
  void restart() { started_ = false; }

 private:
  void start(const Feet& feet, const State& x);
  void follow_ground(const Feet& feet, const State& x, const std::array<FootMotion, 2>& motion, double dt);
  void report(const Feet& feet, const State& x, const std::array<FootMotion, 2>& motion, const VoxelMap* map);

  Contacts contacts_;
  bool started_ = false;
  CueTracker cues_;
  ContactFilter filter_;
  GroundLookup ground_;
  UsualAcceleration usual_acceleration_;
};

}  // namespace kilvo
