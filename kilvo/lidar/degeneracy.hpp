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
  PoseCovariance A = PoseCovariance::Zero();
  PoseCovariance fake = PoseCovariance::Zero();  // expected, from the normals' own noise: sum of cov(J) / sigma^2
  int planes = 1;                                // whose noise is independent
  Eigen::Matrix3d R_WI = Eigen::Matrix3d::Identity();
};

struct Degeneracy {
  PoseCovariance directions = PoseCovariance::Zero();  // unit vectors, scaled (rotation * lever, position), in columns: the weak ones first
  std::array<PoseCovariance, 6> doubt;                 // of where each weak one points, rad^2
  std::array<double, 6> real{}, kept{};                // 1/m^2, along each: without the faked; of it what the sweeps before have as well
  std::array<double, 6> taken{};                       // of project_out() in the last evaluation
  int weak_count = 0;
  double lever = 1;           // m per rad
  double position = 0;        // information on all three of position, 1/m^2
  double smallest_share = 1;  // of the weakest direction, without the faked, in it
  bool turned = false;        // what was weak in the sweeps before is so no longer
};

/// What sweeps in a row did not know. Each takes a slightly different direction for the weak one, as the normals' noise turns it, and an
/// uncertainty of metres along it, seen from another angle each time, would look like something that was measured.
class BlindDirections {
 public:
  void see(const SweepInformation& sweep, const Degeneracy& degeneracy);
  void see_nothing() { *this = {}, part_.setIdentity(); }

  bool any() const { return !part_.isZero(0); }
  /// Takes a pose error to its part along what the last sweep did not know.
  const PoseCovariance& part() const { return part_; }
  /// Mean of the sweeps' A per Degeneracy::position, `sweep` included.
  PoseCovariance mean_with(const SweepInformation& sweep) const;
  /// Mean of Degeneracy::smallest_share, `share` of a sweep included: that of a single one scatters around zero, and what is taken of it
  /// wherever it is positive holds the robot back.
  double mean_share_with(double share) const {
    RunningStatistics with = share_;
    with.add(share, 1);
    return with.mean();
  }
  /// How much of that mean is more than `sigmas` standard deviations of it, 0 to 1.
  double confirmed_with(double share, double sigmas) const;

 private:
  static constexpr int memory = 30;                                               // sweeps
  PoseCovariance part_ = PoseCovariance::Zero(), mean_ = PoseCovariance::Zero();  // the mean with the rotation in the world
  RunningStatistics share_{0, 0, 0, memory};
  int sweeps_ = 0;
};

/// `fake` is subtracted twice. A direction is weak when its share of the information on position (a third each, if the sweep knows all
/// equally well) is below `weak_share`. The sweeps `before` settle where it points.
Degeneracy find_degeneracy(const SweepInformation& sweep, double weak_share, const BlindDirections& before);

/// Takes a pose error (rotation, position) to its part along the weak directions; the transpose of what is left of the identity takes
/// the weak directions out of an information: A -> K A K', K = (I - W)'. Each direction by itself, times `share`.
PoseCovariance weak_part(const Degeneracy& degeneracy, const std::array<double, 6>& share = {1, 1, 1, 1, 1, 1});

/// The information along each weak direction, 1/m^2.
std::array<double, 6> along_weak(const Degeneracy& degeneracy, const PoseCovariance& A);

/// Takes the weak directions out of A and b. They are known to Degeneracy::doubt, so when the prior is uncertain by metres along one of
/// them, the others are trusted to that fraction of it and no better: else every millimetre measured across would become a decimetre
/// along. Degeneracy::kept stays, with `trust` (0 to 1). Returns how much of each weak direction an update by this information then takes
/// from the map (0 to 1); the rest stays as in the prior.
std::array<double, 6> project_out(const Degeneracy& degeneracy, const PoseCovariance& prior, double trust, Information<6>& info);

}  // namespace kilvo
