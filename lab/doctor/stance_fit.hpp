// A foot that stands does not move. With the way of the IMU known from the LiDAR this tells, to a tenth of what the turning alone does, how
// the IMU sits on the robot, when the leg samples were taken, the zeros of the encoders and a common scale of the legs: one least squares
// over all stances, with priors, robust weights and a covariance from the scatter of the stances.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "lab/doctor/camera_fit.hpp"
#include "lab/doctor/leg_path.hpp"

namespace kilvo::lab {

struct StanceFit {
  bool good = false;
  SO3 R_link_imu;
  Eigen::Vector3d rotation_sigma = Eigen::Vector3d::Zero();  // rad, in the link's frame
  double offset = 0, offset_sigma = 0;                       // s: the legs' stamps plus this are on the IMU's clock
  double scale = 1, scale_sigma = 0;                         // of the legs' lengths
  Eigen::Vector3d apart = Eigen::Vector3d::Zero(),
                  apart_sigma = apart;   // m, link's frame: of the left foot; the right one's is its negative
  std::vector<std::string> joints;       // those that move a foot
  std::vector<double> zero, zero_sigma;  // rad, by joint: to be added to its position
  std::vector<double> zero_growth;       // factor by which both would grow if this zero alone might be anything
  double moved = 0;                      // m: how far a standing foot seems to move, robust standard deviation
  std::size_t stances = 0;
};

/// What a fit may change beyond what a careful description is off by: nothing, a joint's zero (of `StanceFit::joints`), where the feet are,
/// the size of the legs and the place of the IMU.
struct StanceFreedom {
  std::optional<std::size_t> joint;
  bool apart = false, size = false;
};

/// `hypothesis`: of the legs, may be null. Starts from robot.imu.T_link_imu and `offset`.
StanceFit fit_stances(RecordedLegs& legs, const Robot& robot, const LegHypothesis* hypothesis, const LidarWay& way, const GyroPath& gyro,
                      double offset, const StanceFreedom& free = {});

/// Standard deviations (rad, by axis) of the first of two measurements of a mount, where both methods may err: larger by what it is farther
/// from the second than both are uncertain by. Soles that roll on the spot take the fit of the stances elsewhere than the turning.
Eigen::Vector3d sigma_beside(const SO3& first, const Eigen::Vector3d& sigma, const SO3& second, const Eigen::Vector3d& second_sigma);

struct Standing {
  std::array<double, 2> of{};  // s, by foot, in which its sole stands while the robot moves
  double moving = 0;           // s, in which the robot moves
  double both() const { return of[0] + of[1]; }
  /// s: a robot that walks stands on either foot, so that one alone counts little.
  double worth() const { return std::min(both(), 4 * std::min(of[0], of[1])); }
};

/// Legs that are described wrongly hardly ever stand.
Standing standing_time(RecordedLegs& legs, const Robot& robot, const LegHypothesis* hypothesis, const LidarWay& way, const GyroPath& gyro,
                       double offset);

struct LegStart {
  double offset = 0;  // s: the legs' stamps plus this are on the IMU's clock
  SO3 R_link_imu;
  Standing standing;
};

/// The offset within `reach` (s) with the described mount of the IMU, or the one of `mounts` without an offset, under which the soles stand
/// longest.
LegStart longest_standing(RecordedLegs& legs, const Robot& robot, const LegHypothesis* hypothesis, const LidarWay& way,
                          const GyroPath& gyro, const std::vector<SO3>& mounts, double reach = 1.3);

/// Likewise, of soles that stand roughly at first, and by the fit that they allow then: one after which they move by less than `still` (m).
LegStart fitted_standing(RecordedLegs& legs, const Robot& robot, const LegHypothesis* hypothesis, const LidarWay& way, const GyroPath& gyro,
                         const std::vector<SO3>& mounts, double still, double reach = 1.3);

}  // namespace kilvo::lab
