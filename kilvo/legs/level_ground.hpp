// Whether the ground on which a robot walks is level, judged by its footholds alone, and then how high it is.
//
// A robot that is not quite as described (its IMU pitched, its encoders off) measures a climb at each step on level ground: the same share
// of the step in its own frame, in any direction of walking. A slope stays where it is in the world while the robot turns. The height of a
// step d is
//   h = m'd_I + s'd_W + noise
// where m (m/m, IMU frame) is what the legs climb too much, and s (m/m, world frame) the slope of the ground. Two hypotheses, level and
// sloped, each with a Kalman filter of (m, s), mixed as interacting models are (Blom and Bar-Shalom 1988). Floors are level more often than
// not, and descriptions are off by no more than a degree or so: these priors decide while the robot walks straight on.
//
// On level ground the footholds also measure the vertical, until the world has been levelled (Levelling).
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

  /// Gravity's direction is known well enough to level a world by it, rad (one standard deviation of either axis).
  static constexpr double known_vertical = 1e-3;

  /// Where the foot that came down last stands by now, m, world frame. `side`: 0 left, 1 right.
  void stands_at(std::size_t side, const Eigen::Vector3d& pc_W);
  /// A foot comes down at p_W (m, world frame): the ground there when that is very likely level, else nothing. `e`: the estimate then.
  std::optional<GroundPatch> touchdown(std::size_t side, const Eigen::Vector3d& p_W, const Estimate& e);
  /// Variance of the height, m^2, for steps that were taken for stairs but may have been motion that the IMU has not measured.
  double stair_variance() const { return stair_variance_; }
  /// The feet are no longer where they stood.
  void restart();
  /// Variance of the height of the floor that is walked on, m^2: what was known of it when the first foot came down there.
  double floor_variance() const { return floor_variance_; }
  /// Something else has measured the height.
  void height_is_measured() { stair_variance_ = floor_variance_ = 0; }

  /// The vertical once it has been settled for good, by which the world may be levelled: unit vector, upwards, world frame.
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
  double step_variance() const;
  void learn(const Eigen::Vector3d& step_W, const SO3& R);
  void find_vertical(const Estimate& e);
  void find_floor(const Eigen::Vector3d& p_W, const Estimate& e);

  Hypothesis level_, sloped_;
  RunningStatistics noise_;  // of the height of a step, m
  std::size_t touchdowns_ = 0;
  std::optional<Time> first_;                        // step of the walk
  Eigen::Vector3d up_W_ = Eigen::Vector3d::UnitZ();  // as it is known by now
  std::optional<Eigen::Vector3d> vertical_W_;
  std::optional<Eigen::Vector3d> last_;  // foothold
  std::optional<std::size_t> has_come_down_;
  double stair_variance_ = 0, floor_variance_ = 0;
  bool is_level_ = false, has_left_floor_ = false;
  std::optional<Eigen::Vector3d> floor_;  // a foothold on the level ground that was walked on last
};

}  // namespace kilvo
