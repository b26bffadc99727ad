#include "kilvo/vision/camera_errors.hpp"

#include <Eigen/LU>

namespace kilvo {
namespace {

// Of a turn (rad) and of a share of the way: an image that is expected to be off by as much for other reasons counts a quarter.
constexpr double small_turn = 5e-4, small_share = 5e-3;

// `excess`: of a squared error over `expected`. An image counts as far as it knows more of the variance than that, one alone little.
void learn(double excess, double expected, double small, RunningStatistics& variance) {
  constexpr double surprising = 10;
  const double known = std::max(0.0, variance.mean()) + small * small, all = known + expected;
  variance.add(std::min(excess, surprising * all), known * known / (all * all));
}

}  // namespace

void CameraErrors::add_turns(const MountCheck::View& image, const VisualMap& map, std::span<const ImageTurn> turns, double expected) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const ImageTurn& turn : turns) {
    const VisualFrame& frame = map.frame(turn.frame);
    if (!check_.add(image, {(T_CI_.R.inverse() * frame.T_CW.R).inverse(), frame.omega}, turn.A, turn.b)) continue;
    A += turn.A;
    b += turn.b;
  }
  if (!(A.determinant() > 0)) return;
  const Eigen::Matrix3d V = A.inverse();
  const double all = V.trace() + expected;
  learn(((V * b).squaredNorm() - all) / 3, all / 3, small_turn, turn_);
}

void CameraErrors::add_way(const Information<7>& info, const State& x, const Estimate& prior, const Eigen::Vector3d& way) {
  const Covariance& P = prior.P;
  const Eigen::Vector3d along = way.normalized();
  const double known = along.dot(info.A.block<3, 3>(3, 3) * along);
  if (!(known > 0)) return;
  // The row of the image's equations A (x - x0) + b = 0 along the way, of (rotation, position, exposure).
  const Eigen::Matrix<double, 7, 1> row = info.A.middleRows<3>(3).transpose() * along / known;
  Eigen::Matrix<double, 7, 1> from_prior;
  from_prior << boxminus(x, prior.x).head<6>(), x.tau - prior.x.tau;
  const double shift = row.dot(from_prior) - along.dot(info.b.segment<3>(3)) / known;
  const double variance = row.head<6>().dot(P.topLeftCorner<6, 6>() * row.head<6>()) + row[6] * row[6] * P(at::tau, at::tau);
  add_shift(shift, 1 / known + variance, way.norm());
}

void CameraErrors::add_shift(double shift, double variance, double way) {
  if (way > 0) learn((shift * shift - variance) / (way * way), variance / (way * way), small_share, way_);
}

Estimate CameraErrors::with_turn(Estimate e) const {
  e.P.topLeftCorner<3, 3>().diagonal().array() += turn_variance();
  return e;
}

std::optional<CameraErrors::Turned> CameraErrors::judge(Time t) {
  const auto psi = check_.misalignment();
  if (!psi) return std::nullopt;
  const SO3 R_IC = SO3::Exp(-*psi) * T_CI_.R.inverse();
  const Eigen::Vector3d turned = (R_IC * R_described_.inverse()).Log();
  if (turned.norm() < likely_mount) {
    T_CI_ = SE3{R_IC, T_CI_.inverse().p}.inverse();
    check_.correct(*psi, 0);
    return Turned{turned, R_IC};
  }
  constexpr Duration first_pause = std::chrono::seconds(10), longest_pause = std::chrono::minutes(5);
  pause_ = pause_ == Duration(0) ? first_pause : std::min(longest_pause, 2 * pause_);
  refused_until_ = t + pause_;
  restart();
  return Turned{turned, std::nullopt};
}

std::optional<double> CameraErrors::clock_offset() {
  const auto offset = check_.time_offset(least_clock_offset);
  if (offset) check_.correct(Eigen::Vector3d::Zero(), *offset / usual_loss);
  return offset;
}

}  // namespace kilvo
