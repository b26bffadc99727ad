#include "kilvo/filter/gap.hpp"

#include <algorithm>

namespace kilvo {
namespace {

// A humanoid that walks: how fast it turns, how much it leans, how much its velocity changes and how far that takes it (one sigma).
constexpr double turning = 0.4;                        // rad/s
constexpr double leaning = 0.06;                       // rad
constexpr double velocity = 0.3, more_velocity = 0.1;  // m/s, m/s per s of the gap
constexpr double acceleration = 3.0;                   // m/s^2: in a short gap the velocity has not had the time to change by all that

}  // namespace

void inflate_covariance_over_gap(Estimate& e, Time begin, Time end, double gap) {
  const double share = gap > 0 ? std::clamp(to_seconds(end - begin) / gap, 0.0, 1.0) : 1.0;
  const double lean = std::min(leaning, turning * gap), turn = turning * gap;
  const double dv = std::min(velocity + more_velocity * gap, acceleration * gap), dp = dv * gap;
  // Leaning is about the horizontal, turning about the vertical.
  const Eigen::Vector3d up_I = e.x.R.matrix().transpose() * -e.x.g.normalized();
  e.P.block<3, 3>(at::R, at::R) +=
      share * (lean * lean * Eigen::Matrix3d::Identity() + std::max(0.0, turn * turn - lean * lean) * up_I * up_I.transpose());
  e.P.diagonal().segment<3>(at::v).array() += share * dv * dv;
  e.P.diagonal().segment<3>(at::p).array() += share * dp * dp;
  // A velocity that changed somewhere in the gap was wrong for half of it.
  e.P.diagonal(at::v - at::p).segment<3>(at::p).array() += 0.5 * share * dv * dp;
  e.P.diagonal(at::p - at::v).segment<3>(at::p).array() += 0.5 * share * dv * dp;
}

}  // namespace kilvo
