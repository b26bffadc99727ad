// A start on the move without legs. While the velocity is unknown, short parts of sweeps are registered one after the other: they smear
// little, and the robot moves by its velocity from part to part. Then all else begins.
#pragma once

#include <optional>

#include "kilvo/estimator/history.hpp"
#include "kilvo/estimator/world_map.hpp"
#include "kilvo/lidar/lidar_pipeline.hpp"
#include "kilvo/sensors/robot.hpp"

namespace kilvo {

/// After so long a start on the move has to do with what it knows.
inline constexpr Duration longest_moving_start = std::chrono::seconds(2);

class MovingStart {
 public:
  /// `start`: the first estimate, whose gravity and biases are guesses.
  MovingStart(const LidarMount& mount, const EstimatorConfig& config, const Estimate& start);

  /// The parts of the next sweep correct the history, up to its end. True when any was registered. `drops`: counts points not used.
  bool add(const LidarScan& scan, History& history, PointDrops& drops);
  /// Another sensor measures the velocity from now on: the result of the sweeps is not kept.
  void give_up(History& history, Time now);
  /// The velocity is known, or was not found for long: gravity and biases, which parts of sweeps hardly measure, are guesses again.
  bool is_over() const { return is_over_; }
  /// What the covariance of a pose there lacks: it is relative to where the parts' map began, or the robot when it was over.
  PoseCovariance error_at(const SE3& T_WI) const { return map_.error_at(T_WI); }

 private:
  void begin_map(Estimate& e);
  void guess_again(Estimate& e) const;
  void doubt_velocity(Estimate& e);
  bool register_part(const LidarScan& part, History& history, PointDrops& drops);

  LidarMount mount_;
  EstimatorConfig config_;
  Estimate start_;
  LidarPipeline lidar_;
  WorldMap map_;
  std::optional<Time> first_sweep_;
  bool is_over_ = false;
  bool is_roughly_known_ = false;  // the velocity: parts from now on are where they are taken to be, and smear little
};

}  // namespace kilvo
