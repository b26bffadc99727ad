#include "lab/doctor/stepping.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace kilvo::lab {
namespace {

Eigen::Vector3d apart(const LegPose& pose) { return pose.foot[1].p[0] - pose.foot[0].p[0]; }

// Without what changes more slowly than steps do: a robot that turns on the spot sets one foot before the other all the time.
std::vector<Eigen::Vector3d> swinging(const std::vector<LegPose>& path) {
  constexpr double around = 4;  // s, to either side: of the mean that is taken away
  std::vector<Eigen::Vector3d> out;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::size_t first = 0, last = 0;  // of the mean
  for (const LegPose& pose : path) {
    for (; last < path.size() && path[last].t < pose.t + around; ++last) sum += apart(path[last]);
    for (; path[first].t < pose.t - around; ++first) sum -= apart(path[first]);
    out.emplace_back(apart(pose) - sum / static_cast<double>(last - first));
  }
  return out;
}

}  // namespace

Stepping stepping_of(const std::vector<LegPose>& path) {
  Stepping out;
  if (path.size() < 2) return out;
  const std::vector<Eigen::Vector3d> swing = swinging(path);
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& s : swing) spread += s * s.transpose() / static_cast<double>(path.size());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  // Of the direction along which the feet move most: forward, or upwards of a robot that steps on the spot.
  const Eigen::Vector3d direction = solver.eigenvectors().col(2);
  constexpr double least = 0.005;  // m, to either side: links that give way move a sole by less
  const double aside = std::max(least, 0.5 * std::sqrt(std::max(0.0, solver.eigenvalues()[2])));
  constexpr double longest = 3;  // s, of a step: a posture that changes is none
  int side = 0;
  double changed = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double s = direction.dot(swing[i]);
    if (std::abs(s) < aside || (s > 0 ? 1 : -1) == side) continue;
    if (side != 0 && path[i].t - changed < longest) {
      if (out.steps == 0) out.begin = path[i].t;
      out.end = path[i].t;
      ++out.steps;
    }
    side = s > 0 ? 1 : -1;
    changed = path[i].t;
  }
  // A foot that stood beside the other passes it in the second step.
  constexpr int first_steps = 2;
  if (out.steps > 1) out.begin -= first_steps * (out.end - out.begin) / (out.steps - 1);
  return out;
}

}  // namespace kilvo::lab
