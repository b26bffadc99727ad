#include "kilvo/estimator/map_error.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "kilvo/filter/pose_error.hpp"
#include "kilvo/math/decompositions.hpp"

namespace kilvo {
namespace {

// A new epoch begins when a variance has changed by this factor, so their number grows with the logarithm of the uncertainty.
constexpr double change = 1.25;
constexpr std::size_t max_epochs = 65536;
// Relative error of a distance that only images measure, from errors of the map's surfaces.
constexpr double scale_error = 1e-3;

// A root of a covariance that may be singular.
PoseCovariance root_of(const PoseCovariance& M) {
  const PoseCovariance padded = M + 1e-16 * PoseCovariance::Identity();
  return padded.llt().matrixL();
}

// Pseudo-inverse of the information: a direction that the planes do not know has no error from them.
PoseCovariance inverse_of_known(const PoseCovariance& A) {
  // Rotation and position are brought to the same size; each axis by itself would blow a weak one up.
  const double rotation = std::sqrt(3.0 / A.topLeftCorner<3, 3>().trace()), position = std::sqrt(3.0 / A.bottomRightCorner<3, 3>().trace());
  Eigen::Matrix<double, 6, 1> scale;
  scale << rotation, rotation, rotation, position, position, position;
  const Eigen::SelfAdjointEigenSolver<PoseCovariance> eig(PoseCovariance(scale.asDiagonal() * A * scale.asDiagonal()));
  constexpr double known = 1e-6;
  const Eigen::Matrix<double, 6, 1> inverse = eig.eigenvalues().unaryExpr([](double l) { return l > known ? 1.0 / l : 0.0; });
  return scale.asDiagonal() * eig.eigenvectors() * inverse.asDiagonal() * eig.eigenvectors().transpose() * scale.asDiagonal();
}

}  // namespace

PoseCovariance MapError::at(const SE3& T_WI) const {
  const PoseCovariance G = from_origin(T_WI);
  return G * now_ * G.transpose();
}

PoseCovariance MapError::total(const SE3& T_WI, const PoseCovariance& P) const {
  const PoseCovariance G = to_origin(T_WI);
  return G * P * G.transpose() + now_;
}

void MapError::lost(const SE3& T_WI, const PoseCovariance& more) {
  const PoseCovariance G = to_origin(T_WI);
  now_ += G * more * G.transpose();
}

std::uint32_t MapError::epoch_now(const SE3& T_WI, const PoseCovariance& P) {
  const PoseCovariance total = P + at(T_WI);
  const PoseCovariance here = from_origin(T_WI);
  constexpr std::size_t recent = 4;
  for (std::size_t k = epochs_.size(), tried = 0; k-- > 0 && tried < recent; ++tried) {
    const PoseCovariance then = here * epochs_[k] * here.transpose();
    const Eigen::Array<double, 6, 1> ratio = total.diagonal().array() / then.diagonal().array();
    if ((ratio < change && ratio > 1 / change).all()) return static_cast<std::uint32_t>(k);
  }
  if (epochs_.size() == max_epochs) return static_cast<std::uint32_t>(epochs_.size() - 1);
  const PoseCovariance G = to_origin(T_WI);
  epochs_.push_back(G * total * G.transpose());
  return static_cast<std::uint32_t>(epochs_.size() - 1);
}

void MapError::registered(const SE3& T_WI, std::span<const EpochInformation> epochs, const PoseCovariance& systematic,
                          const PoseCovariance& weak) {
  PoseCovariance A = PoseCovariance::Zero();
  for (const EpochInformation& e : epochs) A += e.A;
  if (!(A.topLeftCorner<3, 3>().trace() > 0) || !(A.bottomRightCorner<3, 3>().trace() > 0)) return;
  const PoseCovariance inverse = inverse_of_known(A);
  const PoseCovariance G = from_origin(T_WI);
  PoseCovariance root = PoseCovariance::Zero(), kept_root = PoseCovariance::Zero(), kept = PoseCovariance::Zero();
  for (const EpochInformation& e : epochs) {
    kept += e.kept;
    if (e.epoch >= epochs_.size()) continue;
    const PoseCovariance of_epoch = root_of(G * epochs_[e.epoch] * G.transpose());
    root += inverse * e.A * of_epoch;
    kept_root += e.kept * of_epoch;
  }
  // Standard deviations add along the weak directions.
  const PoseCovariance before = at(T_WI);
  PoseCovariance along_weak = weak * before * weak.transpose();
  if (!kept.isZero(0)) {
    // Padded: it is singular where one direction is all that is wrong.
    kept_root += (weak - kept) * root_of(before + 1e-12 * before.trace() * PoseCovariance::Identity());
    along_weak = kept_root * kept_root.transpose();
  }
  const PoseCovariance H = to_origin(T_WI);
  now_ = H * (root * root.transpose() + inverse * systematic * inverse + along_weak) * H.transpose();
}

void MapError::seen(const SE3& T_WI, std::span<const EarlierView> views, const PoseCovariance& weak) {
  if (views.empty()) return;
  const PoseCovariance G = from_origin(T_WI);
  PoseCovariance sum = PoseCovariance::Zero();
  for (const EarlierView& view : views) {
    PoseCovariance error = G * view.error * G.transpose();
    // Each metre is wrong by the same share, so that standard deviations add.
    const double sigma = std::sqrt(std::max(0.0, (weak * error * weak.transpose()).bottomRightCorner<3, 3>().trace())),
                 more = std::sqrt(scale_error * scale_error + view.share) * view.way.norm();
    error.bottomRightCorner<3, 3>().diagonal().array() += (2 * sigma + more) * more;
    sum += view.weight * error;
  }
  const PoseCovariance known = PoseCovariance::Identity() - weak, before = at(T_WI);
  const PoseCovariance H = to_origin(T_WI);
  now_ = H * (known * before * known.transpose() + weak * sum * weak.transpose()) * H.transpose();
}

}  // namespace kilvo
