// One sweep, from the message to the estimate at its middle: undistortion, clusters, registration to the map, and whether it may be
// believed. Owns what has to be remembered of the sweeps; changes neither map nor estimate.
#pragma once

#include <optional>
#include <vector>

#include "kilvo/filter/predict.hpp"
#include "kilvo/filter/trajectory.hpp"
#include "kilvo/filter/update_config.hpp"
#include "kilvo/lidar/mount_error.hpp"
#include "kilvo/lidar/point_to_plane.hpp"
#include "kilvo/lidar/range_noise.hpp"
#include "kilvo/lidar/time_offset.hpp"
#include "kilvo/lidar/undistort.hpp"
#include "kilvo/map/voxel_map.hpp"
#include "kilvo/sensors/reason.hpp"
#include "kilvo/sensors/robot.hpp"

namespace kilvo {

/// A velocity known to this gives a sweep its shape, and separates a stance foot from a moving one, m/s.
inline constexpr double known_velocity = 0.15;

/// What a sweep says.
struct Registration {
  std::optional<Reason> refused;  // the state is not changed
  bool searched = false;          // the prior was too uncertain for the nearest planes to be the right ones
  bool unpredicted = false;       // what predicted it was wrong, and is not used
  Estimate posterior;             // of the prior's time
  bool carries = false;           // it holds three directions at least, and so the estimate; if not, the posterior is the prior
  RegistrationReport report;
  std::vector<PointXYZI> points;  // undistorted to the prior's time, in the IMU frame
  std::vector<PointCluster> clusters;
  double range_noise = 0;                              // m, of one range, as the sweeps so far show it
  std::vector<EpochInformation> by_epoch;              // see LidarModel
  PoseCovariance systematic = PoseCovariance::Zero();  // see LidarModel
  PoseCovariance considered = PoseCovariance::Zero();  // of the pose, beyond the prior's: of a description that is not exact
  PoseCovariance released = PoseCovariance::Zero();    // see LidarPipeline::release()
  /// The posterior is the prior and this sweep, and nothing else.
  bool is_plain() const { return carries && !searched && !unpredicted && released.isZero(0); }
};

class LidarPipeline {
 public:
  LidarPipeline(const LidarMount& mount, const LidarConfig& config, const UpdateConfig& update, int threads);

  /// The first pose is T_WI. Sweeps that end before `t` are used only when the velocity is known: one of an unknown velocity has no shape,
  /// and along a corridor nothing would show it.
  void begin_at(Time t, const SE3& T_WI) {
    begins_at_ = t;
    mount_error_.begin_at(T_WI);
  }
  bool has_shape(Time end, const Estimate& prior) const { return end >= begins_at_ || has_known_velocity(prior); }
  static bool has_known_velocity(const Estimate& e) {
    return e.P.diagonal().segment<3>(at::v).maxCoeff() <= known_velocity * known_velocity;
  }

  /// A sweep begins so long after the last one that was used.
  void note_silence(Duration silence);

  /// What the estimator knows when a sweep comes.
  struct Context {
    Time end;                                            // of the sweep
    const Estimate& prior;                               // at its middle
    const Trajectory& trajectory;                        // covers it
    const ProcessNoise& noise;                           // of the IMU within it
    const PoseCovariance& map_error;                     // of the map around the prior
    bool without_legs = false;                           // no legs measure what a sweep does not hold
    PoseCovariance considered = PoseCovariance::Zero();  // see Registration
  };
  /// Along what the last sweep did not know a prior that is more uncertain than `reach` is taken relative to the planes around: the
  /// nearest ones do not show an error that is larger. Returns the covariance that is then theirs.
  PoseCovariance release(Estimate& prior, const PoseCovariance& map_error, double reach) const;
  /// An empty map takes the sweep as it is. `drops`: counts the points that are not used.
  Registration measure(const LidarScan& scan, const Context& context, const VoxelMap& map, PointDrops& drops);

  /// How far the sweep moved the pose from `prior`, squared, per covariance there. `map_error`: of the map around the prior.
  static double squared_change(const Estimate& prior, const Registration& sweep, const PoseCovariance& map_error);
  /// Of sweeps that are where the covariance says: chi-square with six degrees of freedom, 99.9 %.
  static constexpr double agreeing_change = 22.46;

  /// The registration is used: which directions it knew is remembered.
  void accept(const Registration& sweep);
  /// After an accepted registration: whether the map may grow by it. After an outage the map is joined again, not smeared: it grows when
  /// sweeps have agreed with the prediction some times, or where it has not been before. `map_error`: of the map around the prior.
  bool may_learn(const Estimate& prior, const Registration& sweep, const PoseCovariance& map_error);
  /// A sweep until `t` was refused. True when that has lasted for so long that the robot must be outside of the map, and the map is to
  /// restart; never when it `is_given`.
  bool refuse(Time t, bool map_is_given);
  /// The pose is not known any more: some consistent sweeps must come before the map grows again.
  void rejoin() { sweeps_to_go_ = consistent_sweeps; }
  bool is_rejoining() const { return sweeps_to_go_ > 0; }

  /// What the sweeps' turning against the gyro's says of the LiDAR's clock.
  struct ClockEvidence {
    bool doubtful = false;         // it may be off: nothing that goes with it is to be judged
    std::optional<double> offset;  // s, to be added to the stamps from now on
  };
  /// Before accept(): a sweep from `begin` to `end` turned the state from `prior` to `posterior`.
  ClockEvidence compare_turns(const Estimate& prior, const Estimate& posterior, const Trajectory& trajectory, Time begin, Time end);
  /// Covariance of a pose there from a mount that is not quite as described, see MountError.
  PoseCovariance mount_error_at(const SE3& T_WI) const { return mount_error_.at(T_WI); }

  /// Takes a pose error to its part along what the last sweep did not know.
  const PoseCovariance& unobservable() const { return blind_.part(); }
  bool is_blind_somewhere() const { return blind_.any(); }

 private:
  static constexpr int consistent_sweeps = 3;

  void track(const Estimate& prior, LidarModel& model, const UndistortionNoise& within_scan, Registration& out) const;
  void search(const VoxelMap& map, const Estimate& prior, LidarModel& model, const UndistortionNoise& within_scan, Registration& out) const;

  LidarMount mount_;
  LidarConfig config_;
  UpdateConfig update_;
  Workers workers_;
  OwnBody own_body_;
  Time begins_at_{};
  TimeOffset time_offset_;
  MountError mount_error_;
  RangeNoise range_noise_;
  Time noise_seen_until_{};
  BlindDirections blind_;
  PoseCovariance unknowable_ = PoseCovariance::Zero();  // of blind_.part() what is for the world around: it is not searched for
  int sweeps_to_go_ = 0;                                // consistent sweeps before the map grows again
  std::optional<Time> refused_since_;                   // sweeps that fit nowhere
  std::optional<Time> searched_since_;                  // sweeps that had to be found
};

}  // namespace kilvo
