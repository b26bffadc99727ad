// The world is fixed by the first pose, and its z axis is up as far as the accelerometer at rest knew: its bias tilts it by up to half a
// degree. Walking tells the bias within some seconds; then the world can be turned so that z is up. Once: a world that keeps turning would
// be a motion.
#pragma once

#include <optional>

#include "kilvo/estimator/output.hpp"

namespace kilvo {

class Levelling {
 public:
  /// Looks at the outputs in their order.
  void add(const Output& output);

  /// No more outputs come: what is known now has to do, if that is better than what was known at the start.
  void finish();

  /// The turn of the world; none until gravity is known well enough.
  const std::optional<SO3>& turn() const { return R_LW_; }
  /// By how much the world was tilted, rad.
  double tilt() const { return R_LW_ ? R_LW_->Log().norm() : 0; }

  /// The output as seen from the levelled world.
  static void apply(const SO3& R_LW, Output& output);

 private:
  std::optional<SO3> R_LW_;
  std::optional<Time> first_;
  Eigen::Vector3d g_ = Eigen::Vector3d::Zero();
  double sigma_ = 0, least_sigma_ = 0, first_sigma_ = 0;  // of gravity's direction, rad: of the worse axis, of the better one
};

}  // namespace kilvo
