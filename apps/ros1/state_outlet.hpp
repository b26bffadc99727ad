// Each state, as it comes, to who listens: odometry, transforms, contacts, the ground; and the way so far.
#pragma once

#include <mutex>
#include <optional>
#include <ros/node_handle.h>
#include <string>

#include "apps/ros1/body_motion.hpp"
#include "apps/ros1/parameters.hpp"
#include "apps/ros1/ros_messages.hpp"
#include "kilvo/estimator/smooth_odometry.hpp"
#include "lab/settings/settings.hpp"

namespace kilvo::ros1 {

/// What the newest state says of the estimate as a whole.
struct EstimateState {
  Time t{};
  Modality modality = Modality::coast;
  Reason cause = Reason::start;
  std::uint64_t outputs = 0;
  Eigen::Matrix3d position_covariance = Eigen::Matrix3d::Zero();  // m^2
};

class StateOutlet {
 public:
  StateOutlet(const Parameters& parameters, const lab::Settings& settings);

  /// In time order, from one thread.
  void take(const Output& output);

  /// Of the newest state; none before the first.
  std::optional<EstimateState> newest() const;

  /// Sends the way so far, if it has grown and anyone listens. From any thread.
  void publish_path();

  /// As if nothing had come yet. Not while take() runs.
  void clear();

 private:
  void note(const Output& output, const BodyMotion& best);
  void publish(const ros::Publisher& publisher, const BodyMotion& motion, Time t, const std::string& frame) const;
  void publish_transforms(const BodyMotion& best, const BodyMotion& smooth, Time t);
  void publish_contacts(const Contacts& contacts);
  void publish_ground(const Contacts& contacts);
  void extend_path(const BodyMotion& best, Time t);

  Names names_;
  SE3 T_IB_;
  double rate_variance_;
  double smooth_time_;
  Duration tf_period_;
  std::array<std::string, 2> feet_;
  ros::Publisher odometry_, smooth_odometry_, transforms_, contacts_, ground_, path_;
  SmoothOdometry smooth_;
  std::uint32_t epoch_ = 0;
  std::optional<Time> last_tf_, last_ground_, last_path_;

  mutable std::mutex mutex_;
  std::optional<EstimateState> newest_;
  PathMessage way_;
  bool way_has_grown_ = false;
};

}  // namespace kilvo::ros1
