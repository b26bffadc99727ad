// The world is fixed by the first pose, and its z axis is up as far as the accelerometer at rest knew: its bias tilts it by up to half a
// degree. Walking tells the bias within some seconds; then the world can be turned so that z is up. Once: a world that keeps turning would
// be a motion.
#pragma once

#include <optional>

#include "kilvo/estimator/output.hpp"

namespace kilvo {

class Levelling {
 public:
  /// `longest`: whoever waits for it with the outputs does not wait for ever.
  explicit Levelling(Duration longest = std::chrono::seconds(20)) : longest_(longest) {}

  /// Looks at the outputs of one epoch in their order. The one with which gravity is known well enough gets the event.
  void add(Output& output);

  /// No more outputs come: what is known now has to do, if that is better than what was known at the start. The event, if it turns the
  /// world.
  std::optional<Event> finish();

  /// The turn of the world; none until gravity is known well enough.
  const std::optional<SO3>& turn() const { return R_LW_; }

  /// The output as seen from the levelled world.
  static void apply(const SO3& R_LW, Output& output);

 private:
  Duration longest_;
  std::optional<SO3> R_LW_;
  bool is_settled_ = false;  // by the ground
  std::optional<Time> first_;
  Time last_{};
  Eigen::Vector3d g_ = Eigen::Vector3d::Zero();
  double sigma_ = 0, least_sigma_ = 0, first_sigma_ = 0;  // of gravity's direction, rad: of the worse axis, of the better one
};

}  // namespace kilvo
