// A start on the move without legs. While the velocity is not known a sweep has no shape, but its parts are short enough to have one, and
// from part to part the robot moves by its velocity. Once that is known, all else begins as if it had been known from the start.
#pragma once

#include "kilvo/estimator/history.hpp"
#include "kilvo/estimator/world_map.hpp"
#include "kilvo/lidar/lidar_pipeline.hpp"
#include "kilvo/sensors/robot.hpp"

namespace kilvo {

class MovingStart {
 public:
  /// `start`: the first estimate; gravity and biases are guesses.
  MovingStart(const LidarMount& mount, const EstimatorConfig& config, const Estimate& start);

  /// The parts of the next sweep correct the history, which has come to the sweep's end then.
  void add(const LidarScan& scan, History& history);
  /// The velocity is known, or has not been found for long: gravity and biases are the guesses of the start again, of which parts of sweeps
  /// say too little.
  bool is_over() const { return is_over_; }

 private:
  void register_part(const LidarScan& part, History& history);

  LidarMount mount_;
  EstimatorConfig config_;
  Estimate start_;
  LidarPipeline lidar_;
  WorldMap map_;
  bool is_over_ = false;
  bool is_roughly_known_ = false;  // the velocity: parts from now on are where they are taken to be, and smear little
};

}  // namespace kilvo
