// The leg measurement (paper, Eqs. 4 to 8): a stance foot does not move. Rows of all stance feet are stacked in one update.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "kilvo/filter/measurement_rows.hpp"
#include "kilvo/legs/contact_estimator.hpp"
#include "kilvo/legs/leg_config.hpp"
#include "kilvo/legs/leg_kinematics.hpp"
#include "kilvo/legs/standing_rate.hpp"

namespace kilvo {

/// Soles settle and roll: by so much more, in variance, a foot may move before it counts less.
inline constexpr double room_to_settle = 20;

/// alpha_s of Eq. 8: the factor on the standard deviation of a row, at most.
inline constexpr double largest_scale = 10;

/// The measurement of one foot by one leg sample.
struct Stance {
  bool begins = false;                                   // from now on its contact position is part of the state
  bool ends = false;                                     // from now on it is not
  bool used = false;                                     // it stands: rows are made of it
  SolePoint point;                                       // on which it stands; IMU frame
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();       // from where the point was in the sole before to where it is now; IMU frame, m
  double slide_variance = 0;                             // along the ground since the sample before, m^2
  double variance_scale = 1;                             // factor on the variance of its rows (Eq. 8)
  std::optional<Eigen::Matrix<double, 7, 1>> row_scale;  // another one on that of each: velocity, position, height
  std::optional<GroundPatch> ground;                     // on which it has just come down: its height counts once
  std::optional<GroundPatch> level;                      // the same, relative to the other foot, which stands: normal and sigma
};

/// One leg sample, ready for the filter: it can be applied again when the state before it has been corrected.
struct LegStep {
  Time t{};
  double dt = 0;                                           // since the sample before, s
  double velocity_sigma = 0, vertical_velocity_sigma = 0;  // of a standing sole along each horizontal axis and the vertical, m/s
  std::array<Stance, 2> foot;
  std::optional<GyroBiasReading> gyro_bias;
  std::optional<Eigen::Vector3d> false_velocity;  // by which the state's velocity may be more wrong than it reports, in the world, m/s
  std::optional<double> rise;  // by which the state's vertical velocity may be more wrong than it reports, as the soles show it, m/s
};

/// r = v + R (omega x p + v_fk), the velocity of the contact point in the world (Eq. 5, first row); J over (R, p, v, bg).
struct FootVelocityRow {
  Eigen::Vector3d r;
  Eigen::Matrix3d J_R, J_v, J_bg;
};
/// `gyro`: as measured, rad/s.
FootVelocityRow foot_velocity(const State& x, const SolePoint& point, const Eigen::Vector3d& gyro);

/// r = p + R p_fk - p_c (Eq. 5, second row, in the world); J over (R, p, p_c).
struct FootPositionRow {
  Eigen::Vector3d r;
  Eigen::Matrix3d J_R, J_p, J_pc;
};
FootPositionRow foot_position(const State& x, const SolePoint& point, const Eigen::Vector3d& pc);

/// r = n'(p_c - q), the height of the contact point over the ground (Eq. 6); J over p_c, and over g where the normal is the vertical.
struct FootHeightRow {
  double r;
  Eigen::RowVector3d J_pc, J_g = Eigen::RowVector3d::Zero();
};
FootHeightRow foot_height(const GroundPatch& ground, const State& x, const Eigen::Vector3d& pc);

/// The model that `update` calls: velocity and position of each stance foot that passes the gate, and at touchdown its height.
class LegModel {
 public:
  static constexpr int max_leg_rows = 14;

  LegModel(const LegStep& step, const Eigen::Vector3d& gyro, const LegConfig& config) : step_(step), gyro_(gyro), config_(config) {}

  Rows<max_leg_rows> operator()(const State& x, const Covariance& prior);

  /// Of the last evaluation: which feet passed, and which of them came down on known ground.
  struct Used {
    std::array<bool, 2> motion = {false, false}, height = {false, false};
    std::array<bool, 2> fits = {false, false};  // no row of it is beyond the gate
    int rows() const { return 6 * (motion[0] + motion[1]) + height[0] + height[1]; }
  };
  const Used& used() const { return used_; }

  /// The residual alone, of the rows that were used.
  static Residual<max_leg_rows> residual(const LegStep& step, const State& x, const Eigen::Vector3d& gyro, const Used& used);

 private:
  using LegRows = Rows<max_leg_rows>;
  void add_motion(LegRows& rows, int count, std::size_t side, const State& x, const Covariance& prior);
  bool add_height(LegRows& rows, int count, std::size_t side, const State& x, const Covariance& prior) const;

  const LegStep& step_;
  Eigen::Vector3d gyro_;
  const LegConfig& config_;
  Used used_;
};

/// Puts the contact position of a foot into the state: mean, covariance and cross-covariance from the pose and the kinematics.
void begin_stance(Estimate& e, std::size_t side, const SolePoint& point, const LegConfig& config);
/// Moves it along the sole, by the foot's shift: mean and covariance; and adds what the foot may have slid on the ground.
void move_stance(Estimate& e, std::size_t side, const Stance& foot);
/// Both of these on the mean alone.
void place_stances(State& x, const LegStep& step);
/// Takes it out: its rows and columns become zero.
void end_stance(Estimate& e, std::size_t side);

}  // namespace kilvo
