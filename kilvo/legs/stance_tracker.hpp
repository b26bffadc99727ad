// When a foot enters and leaves the filter, on which point of its sole it stands, and how firmly.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "kilvo/legs/contact_estimator.hpp"
#include "kilvo/legs/ground.hpp"
#include "kilvo/legs/leg_config.hpp"
#include "kilvo/legs/leg_kinematics.hpp"
#include "kilvo/legs/leg_measurements.hpp"
#include "kilvo/legs/sole_noise.hpp"
#include "kilvo/math/running_statistics.hpp"

namespace kilvo {

/// Turns contacts into stances: when a foot enters and leaves the filter, and on which point of its sole it stands.
class StanceTracker {
 public:
  explicit StanceTracker(const LegConfig& config);

  /// Whether the map's ground holds the feet, or how they stand on it is learned, since the height is known better without.
  enum class Ground : std::uint8_t { use, learn };

  struct Support {
    const VoxelMap* map;  // on whose planes the feet come down
    Ground ground;
    bool on_legs_alone;  // nothing else measures the velocity: what both soles seem to do is an error of the state
  };
  /// `omega`: bias-free, rad/s. `sigma_v`: uncertainty of the velocity of x, m/s.
  LegStep step(const Feet& feet, const Contacts& contacts, const State& x, const Eigen::Vector3d& omega, double sigma_v = 0,
               const Support& support = {nullptr, Ground::use, false});

  /// Both feet leave the filter at the next step, to enter anew.
  void restart();
  /// Which feet's rows were within their gates of the last step. A foot that is beyond for a while has slipped: it enters anew.
  void judge(const LegStep& step, const std::array<bool, 2>& passed);

 private:
  using Weights = std::array<double, max_corners>;
  std::optional<GroundPatch> ground_under(const VoxelMap& map, const Eigen::Vector3d& p_W, const Eigen::Vector3d& up_W, Ground ground);
  /// `dt`: since the sample before, s.
  std::array<bool, 2> carriers(const Contacts& contacts, double dt) const;
  std::optional<GroundPatch> level_with_other(std::size_t side, const Eigen::Vector3d& p_W, const State& x,
                                              const Eigen::Vector3d& normal_W);
  void add_ground(std::size_t side, Stance& foot, const State& x, const VoxelMap* map, const Eigen::Vector3d& normal_W, Ground ground);
  bool stuck(std::size_t side, const Feet& feet, const Eigen::Vector3d& omega);
  struct Foot {
    std::optional<Weights> weights;                           // of the corners, in stance
    Time touchdown{};                                         // of this stance
    bool leaves = false;                                      // the filter at the next step
    std::optional<Time> refused_since;                        // its rows are beyond the gate
    Eigen::Vector3d sole_velocity = Eigen::Vector3d::Zero();  // in stance, averaged, in the world, m/s
    FootPose last_pose;
    Time changed{};  // when its encoders last changed
  };

  LegConfig config_;
  std::optional<Time> last_;
  std::array<Foot, 2> feet_;
  double sink_ = 0, sink_variance_ = 0;  // of the feet over the map's planes, as learned, m
  RunningStatistics step_height_;        // of a foot that comes down, over the plane through the other, m
  SoleNoise noise_;
  bool by_foot_, by_row_, has_heights_, by_contacts_;  // of the settings
  GroundLookup places_;                                // of the touchdowns
  StandingRate standing_rate_;
};

}  // namespace kilvo
