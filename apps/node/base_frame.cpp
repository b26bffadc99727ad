#include "apps/node/base_frame.hpp"

#include <fmt/core.h>
#include <stdexcept>

#include "lab/settings/nearest.hpp"
#include "lab/settings/urdf_names.hpp"

namespace kilvo::node {
namespace {

bool is_measured(const lab::LinkKinematics& link, const lab::Settings& settings) {
  return link.is_rigid() || (settings.has(Sensor::legs) && settings.robot.legs.type == "joints");
}

/// The root of the URDF, if it is there and what is between it and the IMU is rigid or measured.
std::string usable_root(const lab::Settings& settings) {
  const Robot& robot = settings.robot;
  if (robot.urdf.empty() || robot.imu.link.empty()) return "";
  const std::string root = LinkTree(robot).root();
  return is_measured(lab::LinkKinematics(robot, root), settings) ? root : "";
}

std::string link_of(const Options& options, const lab::Settings& settings) {
  if (options.base == "imu") return "";
  if (options.base.empty()) return usable_root(settings);
  const std::string link = options.base == "link" ? settings.robot.imu.link : options.base;
  const std::vector<std::string> links = lab::find_urdf_names(settings.robot.urdf).links;
  if (std::ranges::find(links, link) == links.end())
    throw lab::ConfigError(fmt::format("base: {} has no link '{}', nearest is '{}'",
                                       settings.urdf_file.empty() ? "robot.urdf is not given, so it" : settings.urdf_file, link,
                                       lab::nearest(link, links)));
  const lab::LinkKinematics kinematics(settings.robot, link);
  if (!is_measured(kinematics, settings))
    throw lab::ConfigError(
        fmt::format("base: nothing measures {}, which is between the IMU and '{}'; lock it in robot.locked_joints, "
                    "or configure legs.topic",
                    kinematics.first_joint(), link));
  return link;
}

}  // namespace

BaseFrame::Place BaseFrame::place_of(const std::string& link, const lab::Settings& settings) {
  Place out;
  if (link.empty()) {
    out.newest.emplace();
    return out;
  }
  lab::LinkKinematics kinematics(settings.robot, link);
  if (kinematics.is_rigid()) {
    out.newest = kinematics.at_rest();
  } else {
    out.link.emplace(std::move(kinematics));
  }
  return out;
}

BaseFrame::BaseFrame(const Options& options, const lab::Settings& settings) try {
  const std::string link = link_of(options, settings);
  name_ = options.base_frame.empty() ? (link.empty() ? "base_link" : link) : options.base_frame;
  base_ = place_of(link, settings);
  tf_name_ = name_;
  tf_ = base_;
  const std::string root = usable_root(settings);
  const std::vector<std::string> links = lab::find_urdf_names(settings.robot.urdf).links;
  if (root.empty() || name_ == root || std::ranges::find(links, name_) == links.end()) return;
  tf_name_ = root;
  tf_ = place_of(root, settings);
} catch (const std::invalid_argument& error) {
  throw lab::ConfigError(fmt::format("{}: {}", options.config, error.what()));
}

void BaseFrame::Place::take(const JointSample& sample) {
  if (!link) return;
  if (const auto motion = link->at(sample)) newest = motion;
}

void BaseFrame::take(const JointSample& sample) {
  const std::lock_guard lock(mutex_);
  base_.take(sample);
  tf_.take(sample);
}

std::optional<BaseFrame::Motion> BaseFrame::newest() const {
  const std::lock_guard lock(mutex_);
  if (!base_.newest || !tf_.newest) return std::nullopt;
  return Motion{*base_.newest, *tf_.newest};
}

std::string BaseFrame::waiting_for() const {
  const std::lock_guard lock(mutex_);
  for (const Place* place : {&base_, &tf_}) {
    if (!place->newest) return "no pose of the base yet: " + place->link->first_joint() + " has not been measured";
  }
  return "";
}

}  // namespace kilvo::node
