// Which directions of the pose a sweep really knows. Noisy plane normals fake information: along a blank corridor 1 500 of them claim
// centimetres per sweep. Their expected part is taken out, and a direction with nothing left is not updated.
#pragma once

#include <Eigen/Core>

#include "kilvo/filter/measurement_rows.hpp"

namespace kilvo {

struct Degeneracy {
  Eigen::Matrix<double, 6, 6> weak = Eigen::Matrix<double, 6, 6>::Zero();  // unit directions, scaled (rotation * lever, position), in columns
  int weak_count = 0;
  double lever = 1;                // m per rad
  double smallest_information = 0; // of the weakest direction, after subtraction, 1/m^2
};

/// `fake`: expected information from the normals' own noise, sum of cov(J)/sigma^2. `weak_direction`: m.
Degeneracy find_degeneracy(const Eigen::Matrix<double, 6, 6>& A, const Eigen::Matrix<double, 6, 6>& fake, double weak_direction);

/// Takes the weak directions out of A and b.
void project_out(const Degeneracy& degeneracy, Information<6>& info);

}  // namespace kilvo
