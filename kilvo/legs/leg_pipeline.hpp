// One leg sample, from the feet to the rows of the update: which foot is in contact, which one stands and on which point, how much it
// counts. Owns what has to be remembered of the legs; changes no estimate.
#pragma once

#include <array>
#include <memory>

#include "kilvo/filter/state.hpp"
#include "kilvo/legs/contact_detector.hpp"
#include "kilvo/legs/leg_motion_error.hpp"
#include "kilvo/legs/level_ground.hpp"
#include "kilvo/legs/stance_tracker.hpp"

namespace kilvo {

/// A method of contact estimation that is copied with its owner.
class OwnedDetector {
 public:
  /// Throws std::invalid_argument when config.contact names another method than ours and config.detector makes none.
  explicit OwnedDetector(const LegConfig& config);
  OwnedDetector(const OwnedDetector& other) : method_(other.method_->clone()) {}
  OwnedDetector& operator=(const OwnedDetector& other) { return method_->assign(*other.method_), *this; }
  OwnedDetector(OwnedDetector&&) noexcept = default;
  ~OwnedDetector() = default;
  ContactDetector* operator->() { return method_.get(); }
  const ContactDetector* operator->() const { return method_.get(); }

 private:
  std::unique_ptr<ContactDetector> method_;
};

class LegPipeline {
 public:
  /// Throws std::invalid_argument as OwnedDetector does.
  explicit LegPipeline(const LegConfig& config)
      : contacts_(config),
        stances_(config),
        ground_sigma_(config.ground_sigma),
        always_height_(config.height == "always"),
        has_level_ground_(config.height != "never" && config.ground != "contacts") {}

  /// The measurement of `predicted`, the estimate of their time, by the feet, and its computing time. `imu`: of the feet's time. `map`: on
  /// whose planes the feet stand, if any. Allocates nothing.
  struct LegUpdate {
    LegStep step;
    double contact_us = 0;  // the contacts' part of the time
  };
  LegUpdate measure(Feet feet, const Estimate& predicted, const ImuSample& imu, const VoxelMap* map, StanceTracker::Ground ground);

  /// Which feet of the step were used, and not refused.
  void judge(const LegStep& step, const std::array<bool, 2>& passed) { stances_.judge(step, passed); }

  /// On the legs alone one foot carries unless the IMU measures a short flight: true when none has for so long that all restarts.
  bool has_lost_its_stance(const LegStep& step, bool on_legs_alone);
  /// No foot is missed before `t`.
  void expect_a_stance_from(Time t) { last_stance_ = t; }

  /// A foot was used within the time that a runner's flight lasts.
  bool has_stood_lately(Time t) const;
  /// The farthest that a sole has been from the IMU, and a metre at least, m.
  double leg_length() const { return leg_length_; }
  /// When a foot was used last.
  Time last_used_stance() const { return last_used_stance_; }

  const Contacts& contacts() const { return contacts_->contacts(); }
  bool needs_forces() const { return contacts_->needs_forces(); }
  /// Something else has measured the pose, see LegMotionError.
  void pose_is_measured(const Eigen::Matrix3d& unknown);
  /// By how much the pose of `x` may be off because the robot is not quite as described, or a stair was none.
  PoseCovariance description_error(const State& x) const;

  /// See LevelGround.
  const std::optional<Eigen::Vector3d>& vertical() const { return level_ground_.vertical(); }

  /// After a gap in the legs' messages, or of the estimate: nothing of before is known to be true.
  void restart();

 private:
  void find_level_ground(LegStep& step, const Estimate& predicted, StanceTracker::Ground ground);

  OwnedDetector contacts_;
  StanceTracker stances_;
  LevelGround level_ground_;
  double ground_sigma_;  // m
  bool always_height_, has_level_ground_;
  Time last_used_stance_{};  // when a foot was used last
  Time last_stance_{};       // the same, or since when that is waited for
  double leg_length_ = 1;    // m
  LegMotionError motion_error_;
};

}  // namespace kilvo
