#include "kilvo/map/plane.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace kilvo {

void Moments::add(const PointGroup& g, const Eigen::Vector3d& origin) {
  const Eigen::Vector3d m = g.mean - origin;
  count_ += g.count;
  sum_ += g.count * m;
  xx_ += g.scatter(0, 0) + g.count * m.x() * m.x();
  xy_ += g.scatter(0, 1) + g.count * m.x() * m.y();
  xz_ += g.scatter(0, 2) + g.count * m.x() * m.z();
  yy_ += g.scatter(1, 1) + g.count * m.y() * m.y();
  yz_ += g.scatter(1, 2) + g.count * m.y() * m.z();
  zz_ += g.scatter(2, 2) + g.count * m.z() * m.z();
  const auto n = [&g](int i, int j) { return static_cast<float>(g.count * g.noise(i, j)); };
  nxx_ += n(0, 0);
  nxy_ += n(0, 1);
  nxz_ += n(0, 2);
  nyy_ += n(1, 1);
  nyz_ += n(1, 2);
  nzz_ += n(2, 2);
}

Moments& Moments::operator+=(const Moments& o) {
  count_ += o.count_;
  sum_ += o.sum_;
  xx_ += o.xx_, xy_ += o.xy_, xz_ += o.xz_, yy_ += o.yy_, yz_ += o.yz_, zz_ += o.zz_;
  nxx_ += o.nxx_, nxy_ += o.nxy_, nxz_ += o.nxz_, nyy_ += o.nyy_, nyz_ += o.nyz_, nzz_ += o.nzz_;
  return *this;
}

Eigen::Matrix3d Moments::covariance() const {
  const Eigen::Vector3d m = mean();
  Eigen::Matrix3d C;
  C << xx_, xy_, xz_, xy_, yy_, yz_, xz_, yz_, zz_;
  return C / count_ - m * m.transpose();
}

Eigen::Matrix3d Moments::noise() const {
  Eigen::Matrix3f N;
  N << nxx_, nxy_, nxz_, nxy_, nyy_, nyz_, nxz_, nyz_, nzz_;
  return N.cast<double>() / count_;
}

double Plane::variance_at(const Eigen::Vector3d& x) const {
  const Eigen::Vector3f d = (x - centre).cast<float>();
  const float a = axis.dot(d), b = normal.cross(axis).dot(d);
  return static_cast<double>(offset_variance + tilt_variance_1 * a * a + tilt_variance_2 * b * b);
}

std::optional<Plane> fit_plane(const Moments& moments, const Eigen::Vector3d& origin, double min_points, double max_roughness) {
  const double n = moments.count();
  if (n < min_points) return std::nullopt;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eig;
  eig.computeDirect(moments.covariance());
  const Eigen::Vector3d lambda = eig.eigenvalues().cwiseMax(0.0);
  const Eigen::Vector3d normal = eig.eigenvectors().col(0);
  const Eigen::Vector3d axis = eig.eigenvectors().col(2);

  const double sensor = normal.dot(moments.noise() * normal);
  // The thickness of n points has a relative standard deviation of sqrt(2/n).
  const double explained = sensor * (1.0 + 3.0 * std::sqrt(2.0 / n)) + max_roughness * max_roughness;
  constexpr double extent_over_thickness = 4.0;
  if (!(lambda[0] < explained) || !(lambda[1] > extent_over_thickness * std::max(lambda[0], sensor))) return std::nullopt;

  const double rough = std::max(0.0, lambda[0] - sensor);
  // Bumps are seen by many points at once: they average over the area, not over the points.
  constexpr double independent_bumps = 16;
  const double variance = std::max(sensor, lambda[0] - rough) / n + rough / std::min(n, independent_bumps);
  Plane p;
  p.centre = origin + moments.mean();
  p.normal = normal.cast<float>();
  p.axis = axis.cast<float>();
  p.offset_variance = static_cast<float>(variance);
  p.tilt_variance_1 = static_cast<float>(variance / lambda[2]);
  p.tilt_variance_2 = static_cast<float>(variance / lambda[1]);
  p.roughness_variance = static_cast<float>(rough);
  return p;
}

}  // namespace kilvo
