// What the soles of a robot that walks say of the IMU's mount: on the mean they are level, whichever way it goes. Slopes turn with the
// heading, and a wrong mount does not.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "lab/doctor/gyro_path.hpp"
#include "lab/doctor/leg_path.hpp"

namespace kilvo::lab {

struct SoleLevel {
  Eigen::Vector3d turn;         // rad, frame of the link: true mount of the IMU on it = Exp(turn) * described; none about the vertical
  Eigen::Matrix3d information;  // of it, 1/rad^2
  double sigma = 0;             // of either component, rad
};

/// None of a robot with other soles than plates, and of a short walk. `path`: both feet in the frame of the link, stamps on the IMU's clock
/// after `offset` (s) is added. `imu`: SI units. `walks`: whether the soles bear the robot at a time.
std::optional<SoleLevel> sole_level(const std::vector<LegPose>& path, const std::vector<InertialSample>& imu, const GyroPath& gyro,
                                    const SO3& R_link_imu, double offset, const std::function<bool(double)>& walks);

}  // namespace kilvo::lab
