// Which directions of the pose a sweep really knows. Noisy plane normals fake information: along a blank corridor 1 500 of them claim
// centimetres per sweep. Their expected part is taken out, and a direction with nothing left is not updated.
#pragma once

#include <Eigen/Core>
#include <array>

#include "kilvo/filter/measurement_rows.hpp"
#include "kilvo/math/running_statistics.hpp"

namespace kilvo {

/// The rows of one sweep, summed: over (rotation in the body, position in the world), as in the state.
struct SweepInformation {
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 6> fake = Eigen::Matrix<double, 6, 6>::Zero();  // expected, from the normals' own noise: sum of cov(J) / sigma^2
  int planes = 0;                                                          // whose noise is independent
  Eigen::Matrix3d R_WI = Eigen::Matrix3d::Identity();
};

/// Directions are unit vectors in columns, scaled (rotation * lever, position).
struct Degeneracy {
  Eigen::Matrix<double, 6, 6> weak = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> real = Eigen::Matrix<double, 6, 1>::Zero();  // information along each weak one without the faked, 1/m^2
  Eigen::Matrix<double, 6, 1> kept = Eigen::Matrix<double, 6, 1>::Zero();  // of it what the sweeps before have as well
  std::array<Eigen::Matrix<double, 6, 6>, 6> doubt;  // rad^2: covariance of each weak direction, of the first weak_count
  int weak_count = 0;
  double lever = 1;           // m per rad
  double position = 0;        // information on all three of position, 1/m^2
  double smallest_share = 1;  // of the weakest direction, after subtraction, in `position`
  bool turned = false;        // the directions of the sweeps before are no longer weak
};

/// What sweeps in a row did not know. Each takes a slightly different direction for the weak one, as the normals' noise turns it, and an
/// uncertainty of metres along it, seen from another angle each time, would look like something that was measured.
class BlindDirections {
 public:
  void see(const SweepInformation& sweep, const Degeneracy& degeneracy);
  /// A sweep that measured nothing.
  void see_nothing();

  bool any() const { return !part_.isZero(0); }
  /// Takes a pose error to its part along what the last sweep did not know.
  const Eigen::Matrix<double, 6, 6>& part() const { return part_; }

  /// Mean of the sweeps' A in terms of `position`, `sweep` included.
  Eigen::Matrix<double, 6, 6> mean_with(const SweepInformation& sweep) const;
  /// The last sweep's directions, scaled; none if it had another number of them.
  Eigen::Matrix<double, 6, 6> last(int count, const Eigen::Matrix3d& R_WI, double lever) const;
  /// Mean of Degeneracy::real / position of the k-th weak direction, -: that of a single sweep scatters around zero, and what is taken of
  /// it wherever it is positive holds the robot back.
  double mean_share(int k) const { return share_[static_cast<std::size_t>(k)].mean(); }

 private:
  static constexpr double memory = 30;          // sweeps, of the shares
  static constexpr int direction_memory = 100;  // sweeps, of where the weak directions point

  Eigen::Matrix<double, 6, 6> part_ = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 6> mean_ = Eigen::Matrix<double, 6, 6>::Zero();  // of A / position, rotation in the world
  Eigen::Matrix<double, 6, 6> last_ = Eigen::Matrix<double, 6, 6>::Zero();  // weak directions (rad, m), rotation in the world
  int sweeps_ = 0, last_count_ = 0;
  std::array<RunningStatistics, 6> share_ = {none(), none(), none(), none(), none(), none()};
  static RunningStatistics none() { return {0, 0, 0, memory}; }
};

/// A direction is weak when its share of the information on position (a third each, if the sweep knows all equally well) is below
/// `weak_share`. What the sweeps `before` say of the same world settles where it points.
Degeneracy find_degeneracy(const SweepInformation& sweep, double weak_share, const BlindDirections& before);

/// Takes a pose error (rotation, position) to its part along the weak directions; the transpose of what is left of the identity takes
/// the weak directions out of an information: A -> K A K', K = (I - W)'.
Eigen::Matrix<double, 6, 6> weak_part(const Degeneracy& degeneracy);

/// Takes the weak directions out of A and b. They are known to Degeneracy::doubt, so when the prior is uncertain by metres along one of
/// them, the others are trusted to that fraction of it and no better: else every millimetre measured across would become a decimetre
/// along. `alone`: nothing else measures along them, and what is confirmed of them is kept, as far as it can be believed.
void project_out(const Degeneracy& degeneracy, const PoseCovariance& prior, bool alone, Information<6>& info);

}  // namespace kilvo
