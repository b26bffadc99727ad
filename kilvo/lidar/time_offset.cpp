#include "kilvo/lidar/time_offset.hpp"

#include <Eigen/LU>
#include <cmath>

#include "kilvo/filter/innovation.hpp"

namespace kilvo {

void TimeOffset::add(const Eigen::Vector3d& turned, const Eigen::Vector3d& rate) {
  constexpr double kept = 1 - 1.0 / 256;  // so that a clock that changes is found
  constexpr double lively = 0.05;         // rad/s
  if (last_rate_ && (rate - *last_rate_).norm() > lively) {
    Eigen::Matrix<double, 3, 2> H;
    H << rate - *last_rate_, rate;
    N_ = kept * N_ + H.transpose() * H;
    n_ = kept * n_ + H.transpose() * turned;
    turned2_ = kept * turned2_ + turned.squaredNorm();
    sweeps_ = kept * sweeps_ + 1;
  }
  last_rate_ = rate;
}

std::optional<double> TimeOffset::beyond(double least, double sigmas) const {
  if (!(N_.determinant() > 0)) return std::nullopt;
  const Eigen::Matrix2d C = N_.inverse();
  const Eigen::Vector2d x = C * n_;
  const double residual2 = std::max(0.0, turned2_ - x.dot(n_)) / (3 * sweeps_ - 2);
  if (std::abs(x[0]) < std::max(least, sigmas * std::sqrt(residual2 * C(0, 0)))) return std::nullopt;
  return x[0];
}

std::optional<double> TimeOffset::offset(double least) const {
  constexpr double enough = 20, sure = 8;  // sweeps, standard deviations
  const auto seen = sweeps_ < enough ? std::nullopt : beyond(least, sure);
  return seen ? std::optional(usual_loss * *seen) : std::nullopt;
}

bool TimeOffset::is_doubtful() const {
  constexpr double few = 5, sigmas = 3;  // sweeps, -
  return sweeps_ > few && beyond(least_clock_offset, sigmas);
}

}  // namespace kilvo
