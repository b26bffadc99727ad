// The LiDAR measurement (paper, Eq. 11): clusters of undistorted points against the planes of the voxel map.
#pragma once

#include <span>
#include <vector>

#include "kilvo/filter/measurement_rows.hpp"
#include "kilvo/filter/pose_error.hpp"
#include "kilvo/lidar/degeneracy.hpp"
#include "kilvo/lidar/downsample.hpp"
#include "kilvo/lidar/lidar_config.hpp"
#include "kilvo/map/voxel_map.hpp"
#include "kilvo/math/deterministic_sum.hpp"

namespace kilvo {

/// One row: r = n'(R p + t - q), J = dr/d(theta, t) = [(p x R'n)', n'].
struct PointToPlaneRow {
  double r = 0;                                                         // m
  Eigen::Matrix<double, 6, 1> J = Eigen::Matrix<double, 6, 1>::Zero();  // over (rotation, position)
};
PointToPlaneRow point_to_plane(const SE3& T_WI, const Eigen::Vector3d& p_I, const Eigen::Vector3d& n_W, const Eigen::Vector3d& q_W);

/// What the last evaluation used.
struct RegistrationReport {
  int clusters = 0;  // of the sweep
  int matched = 0;   // rows used
  int rejected = 0;  // had a plane but failed the gate
  double chi2_per_row = 0;
  bool doubts_new = false;       // surfaces that are new may move
  SweepInformation information;  // of the first evaluation
  Degeneracy degeneracy;
};

/// The model that `update` calls: at each iterate it looks the planes up anew, gates, and sums the rows.
class LidarModel {
 public:
  /// Keeps references: the map, the clusters and the workers must outlive it. `common_error`: covariance of the pose that the filter's own
  /// lacks, from errors of the map and of the description; the gate is wider by it.
  LidarModel(const VoxelMap& map, std::span<const PointCluster> clusters, const Eigen::Vector3d& p_IL, const PoseCovariance& common_error,
             const LidarConfig& config, const Workers& workers, const BlindDirections* blind = nullptr);

  /// No legs measure what the sweep hardly holds: what of it is not faked is kept, not only what sweeps in a row confirm.
  void keep_weak() { trust_ = 1; }
  /// Sweeps come at this interval (s): what a voxel was first seen to hold a moment ago may be a person who walks, and says little of a
  /// direction that only such surfaces measure.
  void doubt_new_surfaces(double interval);
  Information<6> operator()(const State& x, const Covariance& prior);

  const RegistrationReport& report() const { return report_; }

  /// What the next sweeps will get wrong in the same way, so that they do not average it down: roughness of the planes, and what range
  /// noise does through the weights. Covariance of b = sum w r J of the last evaluation, without the weak directions.
  PoseCovariance systematic() const;

  /// The information of the last evaluation, by epoch of the map, without the weak directions.
  std::vector<EpochInformation> by_epoch() const;

 private:
  struct Association {
    const Plane* plane = nullptr;
    std::uint32_t node = 0;
    std::uint32_t epoch = 0;
    std::uint32_t shared = 0;   // its place in rows_of_plane_: clusters on the same plane have the same
    double weight = 0;          // 1/m^2, of the last evaluation
    double variance = 0;        // of the cluster's mean along the normal: measurement and roughness, m^2
    double plane_variance = 0;  // of the plane under it, common to all clusters of the plane, m^2
    double moved_variance = 0;  // the same, were it a surface that moves, m^2
    PointToPlaneRow row;
    Eigen::Vector3d n_I = Eigen::Vector3d::Zero();  // normal of the plane
  };

  struct Sums;
  struct Waiting;
  // Where a cluster fell the last time, and what was there.
  struct Place {
    VoxelKey leaf = 0;
    VoxelMap::Match plane;
  };
  // An iterate, and the gate's covariance there.
  struct Iterate {
    SE3 T_WI;
    PoseCovariance P;
    Eigen::Vector3d lidar_W;
  };
  void look_up_planes(std::size_t first, std::size_t last, const SE3& T_WI);
  bool associate(std::size_t i, const Iterate& at, Association& out) const;
  void count_rows_of_planes();
  bool is_behind(const VoxelMap::Match& match, const Iterate& at) const;
  bool accept(const VoxelMap::Match& match, const PointCluster& cluster, const Iterate& at, Association& out) const;
  void add_row(std::size_t i, const SE3& T_WI, Waiting& waiting);
  Sums sum_rows(const SE3& T_WI);
  static bool only_new_measures_one(const Sums& sums);

  const VoxelMap& map_;
  std::span<const PointCluster> clusters_;
  Eigen::Vector3d p_IL_;
  PoseCovariance common_error_;
  LidarConfig config_;
  const Workers& workers_;
  std::vector<Place> places_;
  std::vector<Association> associations_;
  std::vector<std::uint32_t> plane_of_node_;  // place in rows_of_plane_; of nodes that have one while rows are counted
  std::vector<std::uint16_t> rows_of_plane_;  // of the last evaluation
  const BlindDirections* blind_;
  bool first_ = true;
  double trust_ = 0;                    // in what is left of a weak direction
  std::vector<double> moved_variance_;  // m^2, of surfaces that were first seen one, two, ... sweeps ago
  RegistrationReport report_;
};

/// The clusters as groups of points in the world, for VoxelMap::insert.
std::vector<PointGroup> to_world(std::span<const PointCluster> clusters, const SE3& T_WI, const Eigen::Vector3d& p_IL,
                                 const LidarConfig& config);

}  // namespace kilvo
