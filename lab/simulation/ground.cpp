#include "lab/simulation/ground.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

namespace kilvo::lab {

double Ground::height(double x, double y) const {
  double z = 0;
  for (const GroundPlate& p : plates_) {
    if (x < p.x0 || x > p.x1 || y < p.y0 || y > p.y1) continue;
    z = std::max(z, p.z0 + (p.z1 - p.z0) * (x - p.x0) / (p.x1 - p.x0));
  }
  return z;
}

SE3 Ground::footing(const BipedShape& shape, double x, double y, double yaw) const {
  const SO3 turn = SO3::Exp({0, 0, yaw});
  const auto corners = shape.sole();
  const Eigen::Vector3d &low = corners[1], &high = corners[2];  // heel right, toe left
  std::vector<Eigen::Vector3d> points;
  double highest = -1e9;
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const double along : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    for (const double across : {0.0, 0.5, 1.0}) {
      Eigen::Vector3d c = turn * Eigen::Vector3d(low.x() + along * (high.x() - low.x()), low.y() + across * (high.y() - low.y()), 0);
      c += Eigen::Vector3d(x, y, 0);
      c.z() = height(c.x(), c.y());
      highest = std::max(highest, c.z());
      const Eigen::Vector3d row(c.x() - x, c.y() - y, 1);
      A += row * row.transpose();
      b += row * c.z();
      points.push_back(c);
    }
  }
  // The plane through these points, when they are in one.
  const Eigen::Vector3d slope = A.inverse() * b;
  double worst = 0;
  for (const Eigen::Vector3d& c : points) worst = std::max(worst, std::abs(slope.dot(Eigen::Vector3d(c.x() - x, c.y() - y, 1)) - c.z()));
  constexpr double rough = 1e-6;
  if (worst > rough) return {turn, {x, y, highest}};
  Eigen::Matrix3d R;
  R.col(2) = Eigen::Vector3d(-slope.x(), -slope.y(), 1).normalized();
  R.col(1) = R.col(2).cross(turn * Eigen::Vector3d::UnitX()).normalized();
  R.col(0) = R.col(1).cross(R.col(2));
  return {SO3::nearest(R), {x, y, slope.z()}};
}

}  // namespace kilvo::lab
