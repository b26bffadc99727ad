#include "apps/ros1/state_outlet.hpp"

#include <algorithm>
#include <ros/names.h>
#include <utility>

namespace kilvo::ros1 {
namespace {

constexpr std::uint32_t most_unsent = 2000;  // states: two seconds of them
constexpr Duration path_period = std::chrono::milliseconds(100);
constexpr double path_step = 0.02;          // m; a robot that stands leaves no trace
constexpr std::size_t longest_path = 4000;  // poses

template <class Vector>
void copy_into(Vector& to, const Eigen::Vector3d& from) {
  to.x = from.x();
  to.y = from.y();
  to.z = from.z();
}

template <class Quaternion>
void copy_into(Quaternion& to, const Eigen::Quaterniond& from) {
  to.x = from.x();
  to.y = from.y();
  to.z = from.z();
  to.w = from.w();
}

template <class Header>
void address(Header& header, Time t, const std::string& frame) {
  header.stamp = ros_time(t);
  header.frame_id = std::string_view(frame);
}

TransformStamped transform(const SE3& T, Time t, const std::string& parent, const std::string& child) {
  TransformStamped out;
  address(out.header, t, parent);
  out.child_frame_id = std::string_view(child);
  copy_into(out.transform.translation, T.p);
  copy_into(out.transform.rotation, T.R.quaternion());
  return out;
}

}  // namespace

StateOutlet::StateOutlet(const Parameters& parameters, const lab::Settings& settings)
    : names_(parameters.names),
      T_IB_(parameters.base_is_link ? settings.robot.imu.T_link_imu.inverse() : SE3{}),
      rate_variance_(settings.estimator.noise.gyro * settings.estimator.noise.gyro * settings.robot.imu.rate),
      smooth_time_(settings.estimator.smooth_time),
      tf_period_(from_seconds(1 / parameters.tf_rate)),
      feet_{settings.robot.feet[0].name, settings.robot.feet[1].name},
      smooth_(smooth_time_) {
  ros::NodeHandle node;
  odometry_ = node.advertise<OdometryMessage>(ros::names::resolve(names_.odometry), most_unsent);
  smooth_odometry_ = node.advertise<OdometryMessage>(ros::names::resolve(names_.smooth), most_unsent);
  contacts_ = node.advertise<JointMessage>(ros::names::resolve(names_.contacts), most_unsent);
  ground_ = node.advertise<PosesMessage>(ros::names::resolve(names_.ground), 100);
  path_ = node.advertise<PathMessage>(ros::names::resolve(names_.path), 1, true);  // who comes late gets the last one
  transforms_ = node.advertise<TransformsMessage>("/tf", 100);
  address(way_.header, Time{}, names_.map_frame);
}

void StateOutlet::take(const Output& output) {
  if (std::exchange(epoch_, output.epoch) != output.epoch) clear();
  const BodyMotion best = body_motion(output, T_IB_, rate_variance_);
  note(output, best);
  if (!best.is_finite()) return;
  const BodyMotion smooth = seen_from(best, output, smooth_.add(output), T_IB_);
  publish(odometry_, best, output.t, names_.map_frame);
  publish(smooth_odometry_, smooth, output.t, names_.odom_frame);
  if (output.contacts && contacts_.getNumSubscribers() > 0) publish_contacts(*output.contacts);
  if (output.contacts && ground_.getNumSubscribers() > 0) publish_ground(*output.contacts);
  if (!last_tf_ || output.t - *last_tf_ >= tf_period_) {
    last_tf_ = output.t;
    publish_transforms(best, smooth, output.t);
  }
  extend_path(best, output.t);
}

void StateOutlet::note(const Output& output, const BodyMotion& best) {
  const std::lock_guard lock(mutex_);
  if (!newest_) newest_.emplace();
  newest_->t = output.t;
  newest_->modality = output.modality;
  newest_->cause = output.cause;
  newest_->position_covariance = best.pose_covariance.topLeftCorner<3, 3>();
  ++newest_->outputs;
}

void StateOutlet::publish(const ros::Publisher& publisher, const BodyMotion& motion, Time t, const std::string& frame) const {
  if (publisher.getNumSubscribers() == 0) return;
  OdometryMessage message;
  address(message.header, t, frame);
  message.child_frame_id = std::string_view(names_.base_frame);
  copy_into(message.pose.pose.position, motion.pose.p);
  copy_into(message.pose.pose.orientation, motion.pose.R.quaternion());
  copy_into(message.twist.twist.linear, motion.v_B);
  copy_into(message.twist.twist.angular, motion.omega_B);
  // Symmetric, so that the order of rows and columns does not matter.
  std::copy_n(motion.pose_covariance.data(), 36, message.pose.covariance.begin());
  std::copy_n(motion.twist_covariance.data(), 36, message.twist.covariance.begin());
  publisher.publish(message);
}

// One parent for each frame: the base hangs on the smooth world, and that on the one in which corrections are steps. A user who gives both
// worlds one name wants the best estimate.
void StateOutlet::publish_transforms(const BodyMotion& best, const BodyMotion& smooth, Time t) {
  TransformsMessage message;
  if (names_.map_frame == names_.odom_frame) {
    message.transforms.push_back(transform(best.pose, t, names_.map_frame, names_.base_frame));
  } else {
    message.transforms.push_back(transform(best.pose * smooth.pose.inverse(), t, names_.map_frame, names_.odom_frame));
    message.transforms.push_back(transform(smooth.pose, t, names_.odom_frame, names_.base_frame));
  }
  transforms_.publish(message);
}

// position: clearance, m; effort: 1 while the foot stands, 0 while it does not; velocity: how far it is from standing still, above 10: it
// moves.
void StateOutlet::publish_contacts(const Contacts& contacts) {
  JointMessage message;
  address(message.header, contacts.t, names_.map_frame);
  for (std::size_t side = 0; side < feet_.size(); ++side) {
    message.name.emplace_back(std::string_view(feet_[side]));
    message.position.push_back(contacts.clearance[side]);
    message.velocity.push_back(contacts.d_fv[side]);
    message.effort.push_back(contacts.on[side] ? 1 : 0);
  }
  contacts_.publish(message);
}

// One pose for each foot: where it stands or stood last; its z axis is the ground's normal.
void StateOutlet::publish_ground(const Contacts& contacts) {
  if (last_ground_ && contacts.t - *last_ground_ < tf_period_) return;
  last_ground_ = contacts.t;
  PosesMessage message;
  address(message.header, contacts.t, names_.map_frame);
  for (const GroundPatch& patch : contacts.ground) {
    Pose& pose = message.poses.emplace_back();
    copy_into(pose.position, patch.point);
    copy_into(pose.orientation, Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), patch.normal));
  }
  ground_.publish(message);
}

void StateOutlet::extend_path(const BodyMotion& best, Time t) {
  if (last_path_ && t - *last_path_ < path_period) return;
  last_path_ = t;
  PoseStamped pose;
  address(pose.header, t, names_.map_frame);
  copy_into(pose.pose.position, best.pose.p);
  copy_into(pose.pose.orientation, best.pose.R.quaternion());
  const std::lock_guard lock(mutex_);
  way_.header.stamp = pose.header.stamp;
  if (!way_.poses.empty()) {
    const auto& last = way_.poses.back().pose.position;
    if ((best.pose.p - Eigen::Vector3d(last.x, last.y, last.z)).norm() < path_step) return;
  }
  // Rarely, and then a quarter: what is moved costs nothing on the average.
  if (way_.poses.size() >= longest_path) way_.poses.erase(way_.poses.begin(), way_.poses.begin() + longest_path / 4);
  way_.poses.push_back(pose);
  way_has_grown_ = true;
}

void StateOutlet::publish_path() {
  if (path_.getNumSubscribers() == 0) return;
  PathMessage copy;
  {
    const std::lock_guard lock(mutex_);
    if (!way_has_grown_) return;
    way_has_grown_ = false;
    copy = way_;
  }
  path_.publish(copy);
}

std::optional<EstimateState> StateOutlet::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

void StateOutlet::clear() {
  smooth_ = SmoothOdometry(smooth_time_);
  last_tf_.reset();
  last_ground_.reset();
  last_path_.reset();
  const std::lock_guard lock(mutex_);
  newest_.reset();
  way_.poses.clear();
  way_has_grown_ = true;
}

}  // namespace kilvo::ros1
