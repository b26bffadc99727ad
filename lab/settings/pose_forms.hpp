// The ways in which a pose may be written beside p and R, and what to answer to one of the opposite direction.
#pragma once

#include <optional>
#include <string>
#include <yaml-cpp/yaml.h>

#include "kilvo/math/se3.hpp"

namespace kilvo::lab {

/// R: 9 numbers row by row, or 3 rows of 3; q: quaternion x, y, z, w; rpy: roll, pitch, yaw about the fixed axes x, y, z in radians, as in
/// a URDF. Throws BadValue.
SO3 read_rotation_form(const std::string& form, const YAML::Node& node);

/// T_lidar_imu for T_imu_lidar; none when the name is not of that shape.
std::optional<std::string> opposite_pose(const std::string& name);

/// For who wrote it in none of the ways.
std::string pose_forms_text();

/// {p: [...], R: [...]} of a matrix of 3 x 4 or 4 x 4 numbers, in rows or one list; none when it has another size. Throws on what are no
/// numbers.
std::optional<std::string> matrix_pose_text(const YAML::Node& matrix);

/// {p: [...], R: [...]} of the inverse of a pose {p, R | q | rpy}. Throws BadValue.
std::string inverse_pose_text(const YAML::Node& pose);

}  // namespace kilvo::lab
