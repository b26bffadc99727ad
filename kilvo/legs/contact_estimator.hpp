// Which foot stands on the ground, without force sensors: from what its corners do in the world (paper, Section V; docs/decisions say where
// this departs from it).
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "kilvo/filter/state.hpp"
#include "kilvo/legs/ground.hpp"
#include "kilvo/legs/leg_config.hpp"
#include "kilvo/legs/leg_kinematics.hpp"

namespace kilvo {

/// What is reported of both feet (left, right).
struct Contacts {
  Time t{};
  std::array<bool, 2> on = {true, true};
  std::array<Time, 2> since{};               // when each foot came down or left
  std::array<double, 2> clearance = {0, 0};  // of the lowest point over the ground on which it stood last, m
  double d_a = 0;                            // normalised deviation of the acceleration
  std::array<double, 2> d_fv = {0, 0};       // normalised deviation of the foot's velocity; above 10: it moves
  std::array<GroundPatch, 2> ground;         // on which each stands or stood last

  /// How long a foot has been on or off, s.
  double phase(std::size_t side) const { return to_seconds(t - since[side]); }
};

/// Velocity in the world of a point that is at p_I and moves by v_I relative to the IMU, m/s. `omega`: bias-free rate, rad/s.
inline Eigen::Vector3d velocity_W(const State& x, const Eigen::Vector3d& p_I, const Eigen::Vector3d& v_I, const Eigen::Vector3d& omega) {
  return x.v + x.R * (omega.cross(p_I) + v_I);
}

/// A sole's slowest corner and its lowest point, in the world.
struct FootMotion {
  double slowest = 0;                                  // speed of the slowest corner, m/s
  double speed = 0;                                    // of the lowest point, m/s
  double vertical = 0;                                 // its upward velocity, m/s
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // its velocity, m/s
  double height = 0;                                   // of the lowest point, against gravity, m
  Eigen::Vector3d lowest = Eigen::Vector3d::Zero();    // the lowest point, m
};
/// `sigma_v`: uncertainty of the state's velocity, m/s; what of a corner's speed it may explain is taken off.
FootMotion motion_of(const FootPose& foot, const State& x, const Eigen::Vector3d& omega, double sigma_v = 0);

class ContactEstimator {
 public:
  explicit ContactEstimator(const LegConfig& config) : config_(config) {}

  /// `x`: the state at feet.t. `omega`, `accel`: bias-free rate (rad/s) and specific force (m/s^2) of the IMU. `map`: where the ground is
  /// looked up, if there is one.
  const Contacts& update(const Feet& feet, const State& x, const Eigen::Vector3d& omega, const Eigen::Vector3d& accel, double sigma_v = 0,
                         const VoxelMap* map = nullptr);

  const Contacts& contacts() const { return contacts_; }
  /// The largest speed of a foot in its last swings, m/s; what all speeds are compared with.
  double swing_speed() const { return swing_speed_; }

  /// Forgets the feet, not the robot: after a gap in the legs' messages. Both are taken as standing until they move; when the velocity is
  /// not known, none until it has shown itself: the foot that stands is the one whose velocity is wrong by what does not change.
  void restart() { started_ = false; }

 private:
  struct Sample {
    Time t{};
    double speed = 0, vertical = 0;
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  };
  static constexpr std::size_t history = 128;
  struct FootState {
    std::array<Sample, history> samples{};
    std::size_t count = 0;
    Time since{};                              // of the present phase
    double peak = 0;                           // speed in this swing, held for two samples
    std::optional<Time> moving, impact, slow;  // since when the cue has been there
    GroundPatch ground;                        // of the last place it stood on
  };
  void start(const Feet& feet, const State& x, const std::array<FootMotion, 2>& motion);
  void guess_standing(const Feet& feet, const State& x, const std::array<FootMotion, 2>& motion);
  bool find_standing(Time t);
  void search(const Feet& feet, const State& x, const std::array<FootMotion, 2>& motion);
  double unsteadiness(const FootState& f, Time t) const;
  bool lifts(FootState& f, const FootMotion& m, Time t) const;
  bool lands(FootState& f, const FootMotion& m, Time t) const;
  bool held(std::optional<Time>& since, bool cue, Time t, Duration at_least) const;
  void stand(FootState& f, const FootMotion& m, const State& x, bool arrives, const VoxelMap* map);
  void learn(double peak, Duration swing);
  void deviate(const Eigen::Vector3d& accel, double dt);

  LegConfig config_;
  Contacts contacts_;
  bool started_ = false;
  std::optional<Time> searching_;             // since when no foot is known to stand
  double swing_speed_ = 0, first_guess_ = 0;  // m/s
  int slow_swings_ = 0;                       // in a row
  Duration period_{};
  GroundLookup ground_;
  std::array<FootState, 2> foot_;
  Eigen::Vector3d accel_mean_ = Eigen::Vector3d::Zero(), accel_variance_ = Eigen::Vector3d::Zero();
};

}  // namespace kilvo
