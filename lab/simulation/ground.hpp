// What the feet stand on: the plane z = 0 and plates on it, each rising linearly along x. The world shows the same plates to the sensors.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "kilvo/math/se3.hpp"
#include "lab/simulation/biped.hpp"

namespace kilvo::lab {

/// Height z0 at x0, z1 at x1, linear between; m.
struct GroundPlate {
  double x0, x1, y0, y1, z0, z1;
};

class Ground {
 public:
  void add(const GroundPlate& plate) { plates_.push_back(plate); }
  const std::vector<GroundPlate>& plates() const { return plates_; }

  /// Of the highest plate above (x, y), else 0.
  double height(double x, double y) const;

  /// Where a foot with its ankle above (x, y) comes to lie: the pose of the sole's point under the ankle, z along the sole's normal. A sole
  /// half on a plate lies level at the height of its highest corner.
  SE3 footing(const BipedShape& shape, double x, double y, double yaw) const;

 private:
  std::vector<GroundPlate> plates_;
};

}  // namespace kilvo::lab
