// One image, from the message to the estimate at its time: which patches of the visual map it should show, how the pose and the exposure
// must be for that, whether that is valid, and what is learnt from it. Owns the visual map; changes neither LiDAR map nor estimate.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "kilvo/filter/pose_error.hpp"
#include "kilvo/filter/state.hpp"
#include "kilvo/filter/update_config.hpp"
#include "kilvo/map/visual_map.hpp"
#include "kilvo/sensors/measurement.hpp"
#include "kilvo/sensors/reason.hpp"
#include "kilvo/sensors/robot.hpp"
#include "kilvo/vision/camera.hpp"
#include "kilvo/vision/camera_errors.hpp"
#include "kilvo/vision/colours.hpp"
#include "kilvo/vision/vision_config.hpp"

namespace kilvo {

class VoxelMap;

/// What the estimator knows when an image comes.
struct ImageContext {
  Estimate prior;        // at the image's time, or that of a later sweep that was there first
  SE3 T_image, T_prior;  // poses of the IMU at the image's and at the prior's time, in one frame, any; the same when the times are
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();        // at the image's time, as measured, rad/s
  PoseCovariance unobservable = PoseCovariance::Zero();  // takes a pose error to its part along what the last sweep did not know
  bool feet_hold = false;                                // stance feet measure the distance along that
};

/// The result of an image.
struct VisualRegistration {
  std::optional<Reason> refused;
  CameraErrors::Turned turned{};  // of mount_doubted
  Estimate posterior;             // of the prior's time; of a refused image the prior, unless it is not finite
  SE3 T_WI;                       // where the image's patches are kept, see VisualPipeline::learn
  int used = 0;                   // patches that were found as they were
  bool carries = false;           // they measure the pose and are most of those that should be: the camera is in use
  /// Along what no sweep measures the pose has the errors of the frames that it was compared with, as given to learn().
  std::vector<EarlierView> drift;
};

class VisualPipeline {
 public:
  VisualPipeline(const CameraMount& mount, const VisionConfig& config, const VisualMapConfig& map, const UpdateConfig& update,
                 double map_radius);
  /// Not between measure() and learn().
  VisualPipeline(VisualPipeline&&) noexcept;
  VisualPipeline& operator=(VisualPipeline&&) noexcept;
  ~VisualPipeline();

  struct Fault {
    Reason reason;
    std::string detail;  // of a size that is not the configured one, the first time
  };
  /// What makes an image no use at all, if anything.
  std::optional<Fault> fault_of(const CameraImage& image);

  /// Images of stamps before `t` are not used: patches kept while the velocity is unknown would be kept at wrong places.
  void begin_at(Time t) { begins_at_ = t; }
  /// Why an image of this time is not looked at, if so.
  std::optional<Reason> refuses(Time image) const;

  /// The points of a sweep (x, y, z, intensity; world, m): they show the occlusions.
  void see(const std::vector<Eigen::Vector4f>& points_W) { seen_W_ = points_W; }

  /// Registers the image.
  VisualRegistration measure(const CameraImage& image, const ImageContext& context);
  /// After a registration that is not refused, of the same image: the visual map learns from it. `error`: of VisualRegistration::T_WI and
  /// of the map around it, as a twist at the world's origin. Returns the points of the sweep that the image shows, coloured.
  std::vector<ColouredPoint> learn(const VoxelMap& map, const PoseCovariance& error);

  /// s, to be added to the stamps of the images, if they are sure to be off. What was seen by the clock as it was is forgotten then.
  std::optional<double> clock_offset();
  /// The LiDAR's clock may be off: the error of the mount seen by images may be that.
  void restart_mount_check();
  /// The map restarts.
  void forget_map();
  const VisualMap& map() const { return map_; }

 private:
  struct Work;  // of the image that is registered
  bool is_lost_among_patches(const ImageContext& context) const;
  void adapt_exposure(Work& work) const;
  Estimate update_by(Work& work);
  void learn_errors(const Work& work);
  bool says_nothing(const Work& work);
  PoseCovariance doubt_of_way(const Work& work, const SE3& T_WI) const;
  std::vector<EarlierView> views_of(const Work& work, const Eigen::Vector3d& p_W) const;
  void judge_points(const Work& work, const VoxelMap& map, const SE3& T_CW, std::uint32_t frame);

  CameraMount mount_;
  VisionConfig config_;
  UpdateConfig update_;
  double map_radius_;  // m
  Camera camera_;
  VisualMap map_;
  CameraErrors errors_;
  Time begins_at_{};
  int in_vain_ = 0;                                   // images in a row in which hardly any patch was found
  Eigen::Vector3d last_p_ = Eigen::Vector3d::Zero();  // of the last image, m
  std::vector<Eigen::Vector4f> seen_W_;
  bool size_is_reported_ = false;
  std::unique_ptr<Work> work_;
};

}  // namespace kilvo
