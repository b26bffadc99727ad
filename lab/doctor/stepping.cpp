#include "lab/doctor/stepping.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace kilvo::lab {

Stepping stepping_of(const std::vector<LegPose>& path) {
  Stepping out;
  if (path.size() < 2) return out;
  const auto n = static_cast<double>(path.size());
  const auto apart = [](const LegPose& pose) -> Eigen::Vector3d { return pose.foot[1].p[0] - pose.foot[0].p[0]; };
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const LegPose& pose : path) mean += apart(pose) / n;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const LegPose& pose : path) spread += (apart(pose) - mean) * (apart(pose) - mean).transpose() / n;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  // Of the direction along which the feet move most: forward, or upwards of a robot that steps on the spot.
  const Eigen::Vector3d direction = solver.eigenvectors().col(2);
  constexpr double least = 0.005;  // m, to either side: links that give way move a sole by less
  const double aside = std::max(least, 0.5 * std::sqrt(std::max(0.0, solver.eigenvalues()[2])));
  int side = 0;
  for (const LegPose& pose : path) {
    const double s = direction.dot(apart(pose) - mean);
    if (std::abs(s) < aside || (s > 0 ? 1 : -1) == side) continue;
    if (side != 0) {
      if (out.steps == 0) out.begin = pose.t;
      out.end = pose.t;
      ++out.steps;
    }
    side = s > 0 ? 1 : -1;
  }
  // A foot that stood beside the other passes it in the second step.
  constexpr int first_steps = 2;
  if (out.steps > 1) out.begin -= first_steps * (out.end - out.begin) / (out.steps - 1);
  return out;
}

}  // namespace kilvo::lab
