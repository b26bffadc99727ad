// Which directions of the pose a sweep really knows. Noisy plane normals fake information: along a blank corridor 1 500 of them claim
// centimetres per sweep. Their expected part is taken out, and a direction with nothing left is not updated.
#pragma once

#include <Eigen/Core>

#include "kilvo/filter/measurement_rows.hpp"

namespace kilvo {

struct Degeneracy {
  Eigen::Matrix<double, 6, 6> weak =
      Eigen::Matrix<double, 6, 6>::Zero();  // unit directions, scaled (rotation * lever, position), in columns
  Eigen::Matrix<double, 6, 1> real = Eigen::Matrix<double, 6, 1>::Zero();  // information along each, without what is faked, 1/m^2
  int weak_count = 0;
  double lever = 1;           // m per rad
  double smallest_share = 1;  // of the weakest direction, after subtraction, in the information of all three of position
};

/// `fake`: expected information from the normals' own noise, sum of cov(J)/sigma^2. A direction is weak when its share of the
/// information on position (a third each, if the sweep knows all equally well) is below `weak_share`.
Degeneracy find_degeneracy(const Eigen::Matrix<double, 6, 6>& A, const Eigen::Matrix<double, 6, 6>& fake, double weak_share);

/// Takes a pose error (rotation, position) to its part along the weak directions; the transpose of what is left of the identity takes
/// the weak directions out of an information: A -> K A K', K = (I - W)'.
Eigen::Matrix<double, 6, 6> weak_part(const Degeneracy& degeneracy);

/// Takes the weak directions out of A and b. The map knows where they point only to some milliradians, so when the prior is uncertain by
/// metres along one of them, the others are trusted to that fraction of it and no better: else every millimetre measured across would
/// become a decimetre along. `alone`: nothing else measures along them, and what is not faked is kept, as far as it can be believed.
void project_out(const Degeneracy& degeneracy, const PoseCovariance& prior, bool alone, Information<6>& info);

}  // namespace kilvo
