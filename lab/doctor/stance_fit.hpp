// A foot that stands does not move. With the way of the IMU known from the LiDAR this tells, to a tenth of what the turning alone does, how
// the IMU sits on the robot, when the leg samples were taken, the zeros of the encoders and a common scale of the legs: one least squares
// over all stances, with priors, robust weights and a covariance from the scatter of the stances.
#pragma once

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
  std::vector<std::string> joints;                           // those that move a foot
  std::vector<double> zero, zero_sigma;                      // rad, by joint: to be added to its position
  double moved = 0;                                          // m: how far a standing foot seems to move, robust standard deviation
  std::size_t stances = 0;
};

/// `hypothesis`: of the legs, may be null. Starts from robot.imu.T_link_imu and `offset`.
StanceFit fit_stances(const Recorded& recorded, const Robot& robot, const LegHypothesis* hypothesis, const LidarWay& way,
                      const GyroPath& gyro, double offset);

/// s, by foot, in which a sole stands while the robot moves. Legs that are described wrongly hardly ever stand.
std::array<double, 2> standing_time(const Recorded& recorded, const Robot& robot, const LegHypothesis* hypothesis, const LidarWay& way,
                                    const GyroPath& gyro, double offset);

}  // namespace kilvo::lab
