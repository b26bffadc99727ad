// Each state, as it comes, to who listens: odometry, transforms, contacts, the ground; and the way so far.
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <string>

#include "apps/live/smooth_odometry.hpp"
#include "apps/node/base_frame.hpp"
#include "apps/node/body_motion.hpp"
#include "apps/node/outlet.hpp"
#include "apps/node/output_messages.hpp"
#include "lab/settings/settings.hpp"

namespace kilvo::node {

/// What the newest state says of the estimate as a whole.
struct EstimateState {
  Time t{};
  std::uint32_t epoch = 0;  // Output::epoch
  Modality modality = Modality::coast;
  Reason cause = Reason::start;
  std::uint64_t outputs = 0;
  Eigen::Matrix3d position_covariance = Eigen::Matrix3d::Zero();  // m^2
  std::vector<Event> events;                                      // of this epoch: one for each sensor and reason, as it went out last
};

class StatePublisher {
 public:
  /// `base` must outlive it.
  StatePublisher(const Options& options, const lab::Settings& settings, const BaseFrame& base, Outlet outlet);

  /// In time order, from one thread; states of an epoch that has ended are left out.
  void take(const Output& output);

  /// What an output reports beside its state, of whatever time it is. From the same thread.
  void note_events(const Output& output);

  /// Of the newest state; none before the first.
  std::optional<EstimateState> newest() const;

  /// From now on nothing is claimed about how exact a state is: the description of the robot is wrong. From any thread.
  void distrust() { trusted_ = false; }

  /// Sends the way so far, if it has grown and anyone listens. From any thread.
  void publish_path();

  /// As if nothing had come yet. Not while take() runs.
  void clear();

 private:
  bool is_of_this_epoch(const Output& output);
  void turn_way(const SO3& R_LW);
  void note(const Output& output, const BodyMotion& best);
  void publish(Topic topic, const BodyMotion& motion, Time t, const std::string& frame) const;
  void publish_transforms(const SE3& best, const SE3& smooth, Time t) const;
  void publish_contacts(const Contacts& contacts) const;
  void publish_ground(const Contacts& contacts);
  void extend_path(const BodyMotion& best, Time t, const std::optional<SO3>& R_LW);

  std::string map_frame_, odom_frame_;
  const BaseFrame& base_;
  Outlet outlet_;
  double rate_variance_;
  double smooth_time_;
  Duration tf_period_;
  std::array<std::string, 2> feet_;
  SmoothOdometry smooth_;
  std::uint32_t epoch_ = 0;
  std::atomic<bool> trusted_{true};
  std::optional<Time> last_tf_, last_ground_, last_path_;

  mutable std::mutex mutex_;
  std::optional<EstimateState> newest_;
  std::vector<Event> events_;
  Path way_;
  bool way_has_grown_ = false, way_is_level_ = false;
};

}  // namespace kilvo::node
