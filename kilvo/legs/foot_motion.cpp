#include "kilvo/legs/foot_motion.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo {

FootMotion motion_of(const FootPose& foot, const State& x, const Eigen::Vector3d& omega, const Eigen::Vector3d& up_W,
                     const Eigen::Vector3d& normal_W) {
  // A sole that comes down does so against the vertical; what it slides or what the state does not know of its velocity is across.
  constexpr double weight_of_vertical = 1.5;
  FootMotion out;
  const SolePoint low = lowest_point(foot, x.R.matrix().transpose() * normal_W);
  out.lowest = x.pose() * low.p;
  out.velocity = velocity_W(x, low.p, low.v, omega);
  out.height = normal_W.dot(out.lowest);
  out.vertical = up_W.dot(out.velocity);
  const double more = weight_of_vertical * weight_of_vertical - 1;
  out.speed = std::sqrt(out.velocity.squaredNorm() + more * out.vertical * out.vertical);
  for (int i = 1; i < foot.corners; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Eigen::Vector3d apart = omega.cross(foot.p[k] - foot.p[0]) + foot.v[k] - foot.v[0];
    out.rolling = std::max(out.rolling, apart.norm());
  }
  return out;
}

std::optional<Eigen::Vector3d> sole_normal(const FootPose& foot, const State& x, const Eigen::Vector3d& up_W) {
  constexpr double least_area = 1e-4;  // m^2
  Eigen::Vector3d across = Eigen::Vector3d::Zero(), largest = Eigen::Vector3d::Zero();
  for (int i = 1; i < foot.corners; ++i) {
    const Eigen::Vector3d side = foot.p[static_cast<std::size_t>(i)] - foot.p[0];
    if (side.squaredNorm() > across.squaredNorm()) across = side;
  }
  for (int i = 1; i < foot.corners; ++i) {
    const Eigen::Vector3d area = across.cross(foot.p[static_cast<std::size_t>(i)] - foot.p[0]);
    if (area.squaredNorm() > largest.squaredNorm()) largest = area;
  }
  if (largest.norm() < least_area) return std::nullopt;
  const Eigen::Vector3d normal_W = x.R * largest.normalized();
  return normal_W.dot(up_W) < 0 ? Eigen::Vector3d(-normal_W) : normal_W;
}

}  // namespace kilvo
