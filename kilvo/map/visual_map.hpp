// What the camera remembers: points on surfaces of the map, each with a few small patches of images that saw it (never whole images), in a
// hash of voxels. Bounded in number per voxel and in all. Frames are the poses and exposures from which the patches were taken.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <tuple>
#include <vector>

#include "kilvo/map/voxel_index.hpp"
#include "kilvo/math/field.hpp"
#include "kilvo/math/se3.hpp"

namespace kilvo {

/// Pixels of each level of an image pyramid around one point.
struct Patch {
  static constexpr int levels = 3;
  static constexpr int size = 16;   // pixels
  static constexpr int before = 7;  // pixels left of and above the one that holds the centre

  std::array<std::array<std::uint8_t, size * size>, levels> pixels;
  int levels_cut = 0;  // the finest ones; others would reach outside their image
};

struct VisualFrame {
  SE3 T_CW;
  double tau = 1;                                   // inverse exposure
  Eigen::Vector3d omega = Eigen::Vector3d::Zero();  // the body's angular rate, rad/s, in its own frame
  /// What the whole pose is wrong by, with the drift that images share: a covariance as `noise` is.
  Eigen::Matrix<double, 6, 6> error = Eigen::Matrix<double, 6, 6>::Zero();
  /// Covariance of what is this frame's own in the error of (rotation, position, tau): the pose as a twist of the world at its origin.
  Eigen::Matrix<double, 7, 7> noise = Eigen::Matrix<double, 7, 7>::Zero();
  std::uint32_t observations = 0;  // that refer to it
};

struct Observation {
  std::uint32_t frame = 0;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // of the point in the frame, level 0
  float agreement = 1;                              // how well later images agreed with it: running mean of their correlation
  Patch patch;
};

struct VisualPoint {
  static constexpr std::size_t most_observations = 4;

  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();  // m
  Eigen::Vector3f normal_W = Eigen::Vector3f::UnitZ();
  float variance = 0;        // of the surface along its normal, m^2
  std::uint32_t node = 0;    // of the plane it lies on (VoxelMap::Match)
  float corner = 0;          // smaller eigenvalue of the gradients' scatter, per pixel, grey^2
  std::uint16_t seen = 0;    // images that agreed
  std::uint16_t failed = 0;  // images that did not, since the last that did
  std::uint8_t count = 0;    // observations
  std::array<std::uint32_t, most_observations> observations{};
  std::uint32_t next = no_index;  // in its voxel
  bool used = false;
};

struct VisualMapConfig {
  double voxel_size = 0.5;  // m
  int per_voxel = 12;
  int max_points = 12000;

  static constexpr auto fields() {
    return std::tuple{Field{"voxel_size", &VisualMapConfig::voxel_size, "m", "edge of the voxels that visual points are kept in"},
                      Field{"points_per_voxel", &VisualMapConfig::per_voxel, "-", "visual points in one voxel at most"},
                      Field{"max_points", &VisualMapConfig::max_points, "-", "visual points in all; the farthest are forgotten first"}};
  }
};

class VisualMap {
 public:
  explicit VisualMap(const VisualMapConfig& config) : config_(config) {}
  void clear() { *this = VisualMap(config_); }

  VoxelKey key_of(const Eigen::Vector3d& x) const {
    const double s = 1.0 / config_.voxel_size;
    return pack_key(fast_floor(x.x() * s), fast_floor(x.y() * s), fast_floor(x.z() * s));
  }

  /// Calls f(id, point) for each point of a voxel.
  template <class F>
  void visit(VoxelKey voxel, F&& f) const {
    for (std::uint32_t i = voxels_.find(voxel); i != no_index; i = points_[i].next) f(i, points_[i]);
  }

  const VisualPoint& point(std::uint32_t id) const { return points_[id]; }
  const Observation& observation(std::uint32_t id) const { return observations_[id]; }
  const VisualFrame& frame(std::uint32_t id) const { return frames_[id]; }
  std::size_t size() const { return size_; }
  std::size_t memory_bytes() const;

  std::uint32_t add_frame(const VisualFrame& frame);
  /// Frames that nothing was taken from.
  void forget_unused_frame(std::uint32_t frame);

  /// A new point with its first observation. False when its voxel is full.
  bool insert(const VisualPoint& point, const Observation& first);
  /// One more view of a point; if it has as many as it may, the one that agreed worst with later images goes, but never the first.
  void observe(std::uint32_t point, const Observation& view);
  /// The surface is known better now. A point that leaves its voxel stays listed there.
  void refresh(std::uint32_t point, const Eigen::Vector3d& p_W, const Eigen::Vector3f& normal_W, float variance, std::uint32_t node);
  /// The result of comparing an image with one observation of a point; a point that images keep disagreeing with is removed.
  void judge(std::uint32_t point, std::uint32_t observation, bool agreed, float correlation);
  /// Forgets points beyond `radius`, and the farthest ones while there are more than max_points.
  void forget(const Eigen::Vector3d& centre, double radius);

 private:
  void remove(std::uint32_t point);
  void release(std::uint32_t observation);
  void unlink(std::uint32_t point);

  VisualMapConfig config_;
  VoxelIndex voxels_;           // to the first point of each
  std::vector<VoxelKey> keys_;  // by point: its voxel
  std::vector<VisualPoint> points_;
  std::vector<Observation> observations_;
  std::vector<VisualFrame> frames_;
  std::vector<std::uint32_t> free_points_, free_observations_, free_frames_;
  std::size_t size_ = 0;
};

}  // namespace kilvo
