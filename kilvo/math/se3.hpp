// Rigid transformations. T_AB takes a point of frame B into frame A: p_A = T_AB * p_B.
#pragma once

#include "kilvo/math/so3.hpp"

namespace kilvo {

struct SE3 {
  SO3 R;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  // m

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return R * x + p; }
  SE3 operator*(const SE3& o) const { return {R * o.R, R * o.p + p}; }
  SE3 inverse() const {
    const SO3 Rt = R.inverse();
    return {Rt, -(Rt * p)};
  }
};

}  // namespace kilvo
