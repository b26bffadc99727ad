// The visual measurement (paper, Eq. 12): patches of the visual map against the image, directly by their grey values, with the inverse
// exposure time as a state. The pixels of one patch are summed into a measurement of its position in the image and of the exposure; only
// then does the pose enter, so that what is uncertain about a patch as a whole (depth, calibration) is noise of the patch, not of pixels.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "kilvo/filter/measurement_rows.hpp"
#include "kilvo/map/visual_map.hpp"
#include "kilvo/vision/brightness.hpp"
#include "kilvo/vision/camera.hpp"
#include "kilvo/vision/mount_check.hpp"
#include "kilvo/vision/patch_sums.hpp"
#include "kilvo/vision/patches.hpp"
#include "kilvo/vision/select_patches.hpp"
#include "kilvo/vision/vision_config.hpp"

namespace kilvo {

/// One patch at one iterate: where it is seen and how that moves with the pose.
struct PatchView {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();                            // level 0
  Eigen::Matrix<double, 2, 6> J = Eigen::Matrix<double, 2, 6>::Zero();        // by (rotation, position), px/rad and px/m
  Eigen::Matrix<double, 2, 3> J_point = Eigen::Matrix<double, 2, 3>::Zero();  // by the point in the world, px/m
};

/// Where a point of the world is seen from a pose of the IMU, and the derivatives; none when it is not.
std::optional<PatchView> view_of(const Camera& camera, const SE3& T_CI, const SE3& T_WI, const Eigen::Vector3d& p_W);

class PhotometricModel {
 public:
  struct Verdict {
    bool looked = false;  // it could be compared
    bool used = false;
    bool moved = false;  // found, but not where it should be
    float correlation = 0;
  };
  struct Report {
    int tracks = 0, used = 0, moved = 0, unlike = 0, saturated = 0;
    double noise = 1;  // of the pixels, times what was expected (standard deviation)
  };
  /// Keeps references: the map, the camera, the pyramid and the tracks must outlive it. `prior`: of the pose before the image; it gives how
  /// coarsely to begin.
  PhotometricModel(const VisualMap& map, const Camera& camera, const SE3& T_CI, std::span<const GreyImage> pyramid,
                   std::span<const PatchCandidate> tracks, const Estimate& prior, const VisionConfig& config);

  Information<7> operator()(const State& x, const Covariance& prior);

  /// How much of what is known of the position comes from the patches of one frame.
  struct FrameShare {
    std::uint32_t frame = 0;
    double weight = 0;  // 1/m^2
  };

  /// How often it must be called to be at the finest level.
  int iterations() const { return static_cast<int>(schedule_.size()); }

  /// The inverse exposure that makes the image as bright as most of the patches. None with too few of them.
  std::optional<Brightness> exposure_at(const State& x) const;

  /// Of the first evaluation.
  const std::vector<ImageTurn>& turns() const { return turns_; }
  // Of the last evaluation:
  const std::vector<Verdict>& verdicts() const { return verdicts_; }
  const Report& report() const { return report_; }
  const std::vector<FrameShare>& by_frame() const { return by_frame_; }

 private:
  struct Prepared {
    Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
    Eigen::Vector3d slide_W = Eigen::Vector3d::Zero();  // how the point moves along its first ray when the surface moves along its normal
    double depth_variance = 0;                          // of the surface, shared by all patches on it
    double tau = 1;                                     // of the observation's frame
    std::uint32_t frame = 0;
    bool plain = false;                   // of use for the exposure alone
    std::optional<PatchView> first_view;  // from the prior's pose
    std::optional<Template> patch;
  };
  struct Part {
    PatchView view;
    PatchSums sums;
    double expected_variance = 1;  // of a pixel's r
    double bias_variance = 1;      // of the brightness of the patch, which may change by itself
    double brightness = 0;         // log of the inverse exposure at which it would look as bright as it did
    bool valid = false;
  };
  std::pair<Values, double> as_first_seen(std::size_t i, const SE3& T_CW) const;  // a patch and its inverse exposure
  bool begins_at(const State& x) const { return x.p == at_.prior.p && x.R.matrix() == at_.prior.R.matrix(); }
  void prepare(int level);
  Part evaluate(std::size_t i, const State& x);
  /// Where a patch is found: how far from where it is seen, and how surely, by itself.
  struct Found {
    Eigen::Vector2d displacement;  // px
    Eigen::Matrix2d variance;      // px^2
  };
  static std::optional<Found> find(const Eigen::Matrix3d& M, const Eigen::Vector3d& b, const Eigen::Matrix2d& shift);
  void note_turn(std::uint32_t frame, const Part& part, const Found& found);
  struct Group;
  Group& group_of(std::uint32_t frame, const State& x, const Covariance& prior);
  void add(std::size_t i, const Part& part, double scale2, const State& x, const Covariance& prior);

  const VisualMap& map_;
  const Camera& camera_;
  struct {
    SE3 T_CI, prior;  // the prior's pose
  } at_;
  std::span<const GreyImage> pyramid_;
  std::span<const PatchCandidate> tracks_;
  VisionConfig config_;
  std::vector<int> schedule_;
  std::size_t call_ = 0;
  int level_ = -1;
  std::vector<Prepared> prepared_;
  std::vector<Verdict> verdicts_;
  Report report_;
  struct Group {
    std::uint32_t frame = 0;
    PoseCovariance P = PoseCovariance::Zero();  // of the pose, and of the frame's, seen from the iterate
    Information<7> info;
  };
  std::vector<Group> groups_;
  std::vector<FrameShare> by_frame_;
  std::vector<ImageTurn> turns_;
};

}  // namespace kilvo
