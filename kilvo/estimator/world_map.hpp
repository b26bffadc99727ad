// The map that sweeps are registered to, with how wrong it is itself.
#pragma once

#include "kilvo/estimator/history.hpp"
#include "kilvo/estimator/map_error.hpp"
#include "kilvo/estimator/prediction_check.hpp"
#include "kilvo/map/voxel_map.hpp"

namespace kilvo {

class WorldMap {
 public:
  WorldMap(const MapConfig& config, const LidarConfig& lidar, const Eigen::Vector3d& p_IL)
      : config_(config), lidar_(lidar), p_IL_(p_IL), surfaces_(config) {}

  /// The surroundings are known: they stay as they are.
  void give(VoxelMap map);
  bool is_given() const { return is_given_; }
  VoxelMap take() { return std::move(surfaces_); }

  const VoxelMap& surfaces() const { return surfaces_; }

  /// Covariance of a pose there from the map's own error, see MapError.
  PoseCovariance error_at(const SE3& T_WI) const { return error_.at(T_WI); }
  const MapError& error() const { return error_; }

  struct Sweep {
    const LidarScan& scan;
    Time end;
    bool without_legs = false;                           // see LidarPipeline::Context
    PoseCovariance considered = PoseCovariance::Zero();  // see Registration
  };
  /// Registers a sweep from `prior`, of its middle. Where it is not for what the IMU reported, that is doubted, see PredictionCheck: then
  /// `history` and `prior` become what they are without. `drops` counts.
  Registration register_sweep(LidarPipeline& lidar, const Sweep& sweep, History& history, Estimate& prior, PointDrops& drops);
  /// Whether the IMU predicts what sweeps find.
  const PredictionCheck& prediction() const { return prediction_; }
  /// A sweep fitted nowhere. True when that has lasted: the robot is outside of the map, which restarts around `prior` unless it was given.
  bool refuse_sweep(LidarPipeline& lidar, const Estimate& prior, Time end);

  /// A sweep was registered, and its posterior is used. `may_grow`: what it saw becomes part of the map, with how uncertain the pose was.
  /// `unobservable`: takes a pose error to its part along what the sweep did not know.
  void learn(const Registration& sweep, const PoseCovariance& unobservable, bool may_grow);
  /// Along what no sweep knows images held the pose against these views.
  void held_against(const SE3& T_WI, std::span<const EarlierView> views, const PoseCovariance& unobservable) {
    error_.seen(T_WI, views, unobservable);
  }
  /// The first sweep: the pose there is wrong by so much more than the filter knows.
  void begin_at(const SE3& T_WI, const PoseCovariance& more) { error_.lost(T_WI, more); }
  /// The robot is outside of the map, farther away than a search would have looked: the map restarts around `e`, and with its first sweep
  /// the frame of the pose.
  void begin_anew(const Estimate& e);
  /// Before the first sweep of a map that has restarted: the pose, however uncertain it has become, is the origin of the frame.
  void begin_frame_at(Estimate& prior);

 private:
  struct Attempt {
    History history;
    Estimate prior;
    Registration sweep;
    PointDrops drops;
  };

  struct Motion {
    double turned2 = 0, pushed2 = 0;  // squared, rad and m/s
  };

  Registration measure(LidarPipeline& lidar, const Sweep& sweep, const History& history, const Estimate& prior, PointDrops& drops) const;
  /// As another history predicts it.
  Attempt attempt(LidarPipeline& lidar, const Sweep& sweep, History history, Time middle, PointDrops drops = {}) const;
  /// What else may have been than `history`, from which the sweep is beside the surfaces or is not where it was predicted: a pose near by,
  /// one that the IMU has not moved to, or samples that are wrong. The best of those that explain it.
  std::optional<Attempt> explain(LidarPipeline& lidar, const Sweep& sweep, const History& history, const Estimate& prior,
                                 const Registration& out);
  static Motion motion_between(const State& base, const State& prior);
  /// The samples of the IMU predict more motion since the last sweep than is usual, as ones do that are wrong.
  bool is_violent(const Motion& motion) const;
  /// It fits nowhere, or is not where it was predicted: in a crowd it would be.
  bool is_lost(const Estimate& prior, const Registration& sweep) const;
  bool agrees(const Estimate& prior, const Registration& sweep) const;
  /// From where it is found from `released`, with the gate of the prior: in that of an uncertain one almost all lies on the surfaces.
  Registration measure_near(LidarPipeline& lidar, const Sweep& sweep, const History& history, Estimate prior,
                            const Estimate& released) const;

  MapConfig config_;
  LidarConfig lidar_;
  Eigen::Vector3d p_IL_;  // m
  VoxelMap surfaces_;
  MapError error_;
  PredictionCheck prediction_;
  Motion usual_motion_;  // between sweeps, as the IMU predicts it: means of the last seconds
  bool is_given_ = false, is_anew_ = false;
  Time agreed_{};           // of the last sweep that did not contradict the prediction
  bool was_moved_ = false;  // the robot, before one that did: none since agreed with it
};

}  // namespace kilvo
