#include "apps/node/state_publisher.hpp"

#include <algorithm>
#include <utility>

#include "kilvo/math/decompositions.hpp"

namespace kilvo::node {
namespace {

constexpr Duration path_period = std::chrono::milliseconds(100);
constexpr double path_step = 0.02;          // m; a robot that stands leaves no trace
constexpr std::size_t longest_path = 4000;  // poses
constexpr double unknown = 1e4;             // m^2, rad^2, (m/s)^2, (rad/s)^2: of a state that nothing is known about

Vector vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Pose pose_message(const SE3& T) {
  const Eigen::Quaterniond q = T.R.quaternion();
  return {vector(T.p), {q.x(), q.y(), q.z(), q.w()}};
}

TransformStamped transform(const SE3& T, Time t, const std::string& parent, const std::string& child) {
  return {{{}, t, parent}, child, pose_message(T)};
}

}  // namespace

StatePublisher::StatePublisher(const Options& options, const lab::Settings& settings, const BaseFrame& base, Outlet outlet)
    : map_frame_(options.map_frame),
      odom_frame_(options.odom_frame),
      base_(base),
      outlet_(std::move(outlet)),
      rate_variance_(settings.estimator.noise.gyro * settings.estimator.noise.gyro * settings.robot.imu.rate),
      smooth_time_(settings.estimator.smooth_time),
      tf_period_(from_seconds(1 / options.tf_rate)),
      feet_{settings.robot.feet[0].name, settings.robot.feet[1].name},
      smooth_(smooth_time_) {
  way_.header.frame_id = map_frame_;
}

void StatePublisher::take(const Output& output) {
  if (!is_of_this_epoch(output)) return;
  const auto base = base_.newest();
  BodyMotion best = body_motion(output, base ? base->base : lab::LinkMotion{}, rate_variance_);
  if (!trusted_) {
    best.pose_covariance.diagonal().array() += unknown;
    best.twist_covariance.diagonal().array() += unknown;
  }
  note(output, best);
  if (!best.is_finite() || !base) return;
  const SE3 T_OI = smooth_.add(output);
  publish(Topic::odometry, best, output.t, map_frame_);
  publish(Topic::smooth, seen_from(best, output, T_OI, base->base.T_IL), output.t, odom_frame_);
  if (output.contacts && outlet_.is_wanted(Topic::contacts)) publish_contacts(*output.contacts);
  if (output.contacts && outlet_.is_wanted(Topic::ground)) publish_ground(*output.contacts);
  if (!last_tf_ || output.t - *last_tf_ >= tf_period_) {
    last_tf_ = output.t;
    publish_transforms(output.x.pose() * base->tf.T_IL, T_OI * base->tf.T_IL, output.t);
  }
  extend_path(best, output.t, output.R_LW);
}

// With the first output of an epoch everything begins anew; its events come before the last states of the one before.
bool StatePublisher::is_of_this_epoch(const Output& output) {
  if (output.epoch > epoch_) {
    clear();
    epoch_ = output.epoch;
  }
  return output.epoch == epoch_;
}

void StatePublisher::note_events(const Output& output) {
  if (output.events.empty() || !is_of_this_epoch(output)) return;
  const std::lock_guard lock(mutex_);
  for (const Event& event : output.events) {
    const auto same = [&event](const Event& e) { return e.sensor == event.sensor && e.reason == event.reason; };
    std::erase_if(events_, same);
    // What the epoch before had not told yet comes with the first output of this one, by another time.
    if (event.t <= output.t) events_.push_back(event);
  }
}

void StatePublisher::note(const Output& output, const BodyMotion& best) {
  const std::lock_guard lock(mutex_);
  if (!newest_) newest_.emplace();
  newest_->t = output.t;
  newest_->epoch = output.epoch;
  newest_->modality = output.modality;
  newest_->cause = output.cause;
  newest_->position_covariance = best.pose_covariance.topLeftCorner<3, 3>();
  ++newest_->outputs;
}

void StatePublisher::publish(Topic topic, const BodyMotion& motion, Time t, const std::string& frame) const {
  if (!outlet_.is_wanted(topic)) return;
  Odometry message;
  message.header = {{}, t, frame};
  message.child_frame_id = base_.name();
  message.pose = pose_message(motion.pose);
  message.linear = vector(motion.v_B);
  message.angular = vector(motion.omega_B);
  // Symmetric, so that the order of rows and columns does not matter.
  std::copy_n(motion.pose_covariance.data(), 36, message.pose_covariance.begin());
  std::copy_n(motion.twist_covariance.data(), 36, message.twist_covariance.begin());
  outlet_.publish(topic, t, message);
}

// One parent for each frame: the base hangs on the smooth world, and that on the one in which corrections are steps. A user who gives both
// worlds one name wants the best estimate.
void StatePublisher::publish_transforms(const SE3& best, const SE3& smooth, Time t) const {
  Transforms message;
  if (map_frame_ == odom_frame_) {
    message.transforms.push_back(transform(best, t, map_frame_, base_.tf_name()));
  } else {
    message.transforms.push_back(transform(best * smooth.inverse(), t, map_frame_, odom_frame_));
    message.transforms.push_back(transform(smooth, t, odom_frame_, base_.tf_name()));
  }
  outlet_.publish(Topic::transforms, t, message);
}

// position: clearance, m; effort: 1 while the foot stands, 0 while it does not; velocity: how far it is from standing still, above 10: it
// moves.
void StatePublisher::publish_contacts(const Contacts& contacts) const {
  JointState message;
  message.header = {{}, contacts.t, map_frame_};
  for (std::size_t side = 0; side < feet_.size(); ++side) {
    message.names.push_back(feet_[side]);
    message.position.push_back(contacts.clearance[side]);
    message.velocity.push_back(contacts.d_fv[side]);
    message.effort.push_back(contacts.on[side] ? 1 : 0);
  }
  outlet_.publish(Topic::contacts, contacts.t, message);
}

// One pose for each foot: where it stands or stood last; its z axis is the ground's normal.
void StatePublisher::publish_ground(const Contacts& contacts) {
  if (last_ground_ && contacts.t - *last_ground_ < tf_period_) return;
  last_ground_ = contacts.t;
  Poses message;
  message.header = {{}, contacts.t, map_frame_};
  for (const GroundPatch& patch : contacts.ground) {
    const SO3 R = SO3::nearest(Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), patch.normal).toRotationMatrix());
    message.poses.push_back(pose_message({R, patch.point}));
  }
  outlet_.publish(Topic::ground, contacts.t, message);
}

// The way is one, and so is the world that it is in.
void StatePublisher::turn_way(const SO3& R_LW) {
  for (PoseStamped& stamped : way_.poses) {
    const auto& [p, q] = stamped.pose;
    stamped.pose = pose_message(SE3{R_LW, Eigen::Vector3d::Zero()} *
                                SE3{SO3::from_quaternion(Eigen::Quaterniond(q.w, q.x, q.y, q.z)), Eigen::Vector3d(p.x, p.y, p.z)});
  }
}

void StatePublisher::extend_path(const BodyMotion& best, Time t, const std::optional<SO3>& R_LW) {
  if (last_path_ && t - *last_path_ < path_period) return;
  last_path_ = t;
  const std::lock_guard lock(mutex_);
  if (R_LW && !std::exchange(way_is_level_, true)) turn_way(*R_LW);
  way_.header.stamp = t;
  if (!way_.poses.empty()) {
    const Vector& last = way_.poses.back().pose.position;
    if ((best.pose.p - Eigen::Vector3d(last.x, last.y, last.z)).norm() < path_step) return;
  }
  // Rarely, and then a quarter: what is moved costs nothing on the average.
  if (way_.poses.size() >= longest_path) way_.poses.erase(way_.poses.begin(), way_.poses.begin() + longest_path / 4);
  PoseStamped& pose = way_.poses.emplace_back();
  pose.header.stamp = t;
  pose.header.frame_id = map_frame_;
  pose.pose = pose_message(best.pose);
  way_has_grown_ = true;
}

void StatePublisher::publish_path() {
  if (!outlet_.is_wanted(Topic::path)) return;
  Path copy;
  {
    const std::lock_guard lock(mutex_);
    if (!way_has_grown_) return;
    way_has_grown_ = false;
    copy = way_;
  }
  outlet_.publish(Topic::path, copy.header.stamp, copy);
}

std::optional<EstimateState> StatePublisher::newest() const {
  const std::lock_guard lock(mutex_);
  std::optional<EstimateState> out = newest_;
  if (out) out->events = events_;
  return out;
}

void StatePublisher::clear() {
  smooth_ = SmoothOdometry(smooth_time_);
  last_tf_.reset();
  last_ground_.reset();
  last_path_.reset();
  const std::lock_guard lock(mutex_);
  epoch_ = 0;
  newest_.reset();
  events_.clear();
  way_.poses.clear();
  way_has_grown_ = true;
  way_is_level_ = false;
}

}  // namespace kilvo::node
