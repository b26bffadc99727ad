// The paper's contact estimation (Section V), as it is printed: deviations from the robot's own statistics of its first swing, with the
// same two numbers (theta_d, N_d) for every robot and gait. For legs.contact: paper. What the text leaves open: docs/decisions/paper.md.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "kilvo/legs/contact_detector.hpp"
#include "kilvo/legs/leg_measurements.hpp"
#include "lab/contacts/clearance_window.hpp"
#include "lab/contacts/signal_statistics.hpp"

namespace kilvo::lab {

/// A cue that counts only once it has lasted.
class HeldCue {
 public:
  /// True once `on` has been true in each sample of N_d frames; a frame is 1 ms of leg time, and three samples it must be.
  bool update(bool on, Time t);
  void reset() { samples_ = 0; }

 private:
  Time since_{};
  int samples_ = 0;
};

class PaperContactEstimator final : public CopyableDetector<PaperContactEstimator> {
 public:
  static constexpr int N_d = 5;  // frames

  /// Velocity, position and height of a supporting foot: the rows of r_c (Eq. 7).
  using Residual = Eigen::Matrix<double, 7, 1>;

  /// `x`: the state at feet.t. `omega`, `accel`: bias-free rate (rad/s), specific force (m/s^2) of the IMU. `map`: of the ground, if any.
  const Contacts& update(const Feet& feet, const State& x, const Eigen::Vector3d& omega, const Eigen::Vector3d& accel, double sigma_v = 0,
                         const VoxelMap* map = nullptr) override;
  const Contacts& contacts() const override { return contacts_; }

  /// Forgets the feet, not the statistics: after a gap in the legs' messages. Both are taken as standing until they move.
  void restart() override { started_ = false; }
  /// Eq. 8, row by row. A foot that is used without a detected contact, because no other has one, keeps its large noise. Without a map, and
  /// where it is not known to be level, the ground is that of the earlier contacts (KI).
  void adapt(LegStep& step, const State& x, const Eigen::Vector3d& gyro, const Height& height) override;

  /// r_c of a foot that carries rows in this sample: while the first swing lasts its statistics are learned from it.
  void learn(std::size_t side, const Residual& r);
  /// Eq. 8, row by row: the factor on each row's variance. Ones before there are statistics.
  Residual row_scale(const Residual& r) const;

  /// The ground that earlier contacts span under the contact of this foot; nothing before there were three.
  const std::optional<GroundPatch>& contact_patch(std::size_t side) const { return foot_[side].contact_patch; }

  /// Delta t_sw, known with S_sw: the first step has been completed.
  std::optional<Duration> swing_time() const { return swing_time_; }

 private:
  /// S_st or S_sw: of the acceleration, of the velocity of a supporting foot and of its residual.
  struct Reference {
    SignalStatistics<3> accel, foot_velocity;
    SignalStatistics<7> residual;
  };
  struct FootMotionNow {
    Eigen::Vector3d velocity, lowest;  // in the world, m/s and m
  };
  struct FootState {
    HeldCue moving, slow, calm, fast;
    bool settled = true;                         // since touchdown
    bool was_fast = false, passed_peak = false;  // since lift-off
    GroundPatch ground;
    std::optional<GroundPatch> contact_patch;
    ClearanceWindow clearances;
  };

  void start(const Feet& feet, const State& x, const std::array<FootMotionNow, 2>& motion);
  bool record_still_start(Time t, const Eigen::Vector3d& accel, const std::array<FootMotionNow, 2>& motion);
  void record_first_swing(const Eigen::Vector3d& accel, const std::array<FootMotionNow, 2>& motion);
  void lift_off(std::size_t side, Time t);
  void touchdown(std::size_t side, Time t, const FootMotionNow& m, const State& x, const VoxelMap* map);
  bool lands(std::size_t side, bool impact, double d_fv, Time t);
  bool has_larger_area(std::size_t side) const;
  Duration window() const;

  Contacts contacts_;
  bool started_ = false;
  Time still_since_{};
  Reference static_, swing_, learning_;  // S_st, S_sw, and S_sw while the first swing lasts
  bool static_known_ = false;
  std::optional<Duration> swing_time_;
  std::optional<std::size_t> first_swing_;  // the foot whose swing S_sw is learned from
  HeldCue impact_;
  GroundLookup ground_;
  int touchdowns_ = 0;
  std::array<FootState, 2> foot_;
};

}  // namespace kilvo::lab
