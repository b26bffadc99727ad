// A plane with its uncertainty, fitted from the moments of points (Yuan et al., "Efficient and probabilistic adaptive voxel mapping
// for accurate online LiDAR odometry", 2022, in closed form: the moments stand for the points).
#pragma once

#include <Eigen/Core>
#include <optional>

namespace kilvo {

/// Points that were seen together in one small cell: their number, mean and scatter stand for all of them.
struct PointGroup {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();     // m
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();  // sum of (x - mean)(x - mean)', m^2
  Eigen::Matrix3d noise = Eigen::Matrix3d::Zero();    // measurement covariance of one point, m^2
  double count = 0;
};

/// Incremental moments of points around a fixed origin, and the mean of their measurement covariances.
class Moments {
 public:
  void add(const PointGroup& group, const Eigen::Vector3d& origin);
  /// Those of the same origin.
  Moments& operator+=(const Moments& other);
  double count() const { return count_; }
  Eigen::Vector3d mean() const { return sum_ / count_; }  // relative to the origin
  Eigen::Matrix3d covariance() const;                     // of the points, not of their mean
  Eigen::Matrix3d noise() const;                          // mean measurement covariance of one point

 private:
  double count_ = 0;
  Eigen::Vector3d sum_ = Eigen::Vector3d::Zero();
  double xx_ = 0, xy_ = 0, xz_ = 0, yy_ = 0, yz_ = 0, zz_ = 0;
  float nxx_ = 0, nxy_ = 0, nxz_ = 0, nyy_ = 0, nyz_ = 0, nzz_ = 0;
};

struct Plane {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // mean of its points, m
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();
  Eigen::Vector3f axis = Eigen::Vector3f::UnitX();  // in the plane, direction of largest extent; the other is normal x axis
  float tilt_variance_1 = 0;                        // of the normal's turn towards `axis`, rad^2
  float tilt_variance_2 = 0;                        // towards the other axis, rad^2
  float offset_variance = 0;                        // of the centre along the normal, m^2
  float roughness_variance = 0;                     // how far the surface itself leaves the plane, m^2

  /// Signed distance of a point, m.
  double distance(const Eigen::Vector3d& x) const { return normal.cast<double>().dot(x - centre); }
  /// Variance of the plane's own position under x: offset and tilt, m^2.
  double variance_at(const Eigen::Vector3d& x) const;
};

/// The plane through points with these moments around `origin`, if they are enough and lie on one: their thickness is what measurement
/// noise and `max_roughness` (m) explain, and their extent in both other directions is well above it.
std::optional<Plane> fit_plane(const Moments& moments, const Eigen::Vector3d& origin, double min_points, double max_roughness);

}  // namespace kilvo
