// Whether the ground on which a robot walks is level, judged by its footholds alone, and then how high it is.
//
// A robot that is not quite as described (its IMU pitched, its encoders off) measures a climb at each step on level ground: the same share
// of the step in its own frame, whichever way it goes. A slope stays where it is in the world while the robot turns. The height of a step d
// is
//   h = m'd_I + s'd_W + noise
// where m is what the legs climb too much, and s the slope of the ground, if it has one. Two hypotheses, level and sloped, each with a
// Kalman filter of (m, s), mixed as interacting models are (Blom and Bar-Shalom 1988). Floors are level more often than not, and
// descriptions are off by no more than a degree or so: these priors decide while the robot walks straight on.
//
// On level ground the footholds tell the filter where up is, too, until the world has been levelled (Levelling).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>

#include "kilvo/filter/state.hpp"
#include "kilvo/legs/ground.hpp"
#include "kilvo/math/running_statistics.hpp"

namespace kilvo {

class LevelGround {
 public:
  LevelGround();

  /// Where the foot that came down last stands, as the filter knows it by now, m.
  void stands_at(std::size_t side, const Eigen::Vector3d& pc_W);
  /// A foot comes down at p_W: the ground there when that is very likely level.
  std::optional<GroundPatch> touchdown(std::size_t side, const Eigen::Vector3d& p_W, const Estimate& e);
  /// By how much the height may be off because a stair was none, but a push that the IMU has not measured: variance, m^2.
  double doubt2() const { return doubt2_; }
  /// The feet are no longer where they stood.
  void restart();
  /// Something else measures the height.
  void height_is_measured();

  /// The vertical, once it has been settled for good: what the world may be levelled by.
  const std::optional<Eigen::Vector3d>& vertical() const { return vertical_W_; }

 private:
  using Vector = Eigen::Matrix<double, 6, 1>;  // m, s
  using Matrix = Eigen::Matrix<double, 6, 6>;
  struct Hypothesis {
    double probability;
    Vector mean;
    Matrix P;
  };
  static Hypothesis mix(const Hypothesis& a, const Hypothesis& b);
  void predict(double way);
  void learn(const Eigen::Vector3d& step_W, const SO3& R);
  void find_vertical(const Estimate& e);

  Hypothesis level_, sloped_;
  RunningStatistics noise_;                          // of the height of a step, m
  std::optional<Time> first_;                        // step
  Eigen::Vector3d up_W_ = Eigen::Vector3d::UnitZ();  // as it is known by now
  std::optional<Eigen::Vector3d> vertical_W_;
  std::optional<Eigen::Vector3d> last_;  // foothold
  std::optional<std::size_t> has_come_down_;
  double doubt2_ = 0;
  bool is_level_ = false;
  std::optional<Eigen::Vector3d> floor_;  // a foothold on the level ground that was walked on last
};

}  // namespace kilvo
