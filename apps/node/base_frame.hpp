// Which part of the robot the odometry is of, and which frame the transforms lead to. A link below the root of the URDF has its parent
// from robot_state_publisher, and no frame may have two: transforms then lead to the root, through the joints in between.
#pragma once

#include <mutex>
#include <optional>
#include <string>

#include "apps/node/options.hpp"
#include "lab/clocks/link_kinematics.hpp"
#include "lab/settings/settings.hpp"

namespace kilvo::node {

class BaseFrame {
 public:
  /// Throws lab::ConfigError when there is no such link, or nothing measures its joints.
  BaseFrame(const Options& options, const lab::Settings& settings);

  const std::string& name() const { return name_; }
  /// The frame that the transforms lead to.
  const std::string& tf_name() const { return tf_name_; }

  /// From any thread: the newest joints. Allocates only when their names change.
  void take(const JointSample& sample);

  /// Of the newest joints; nothing while they have not been measured.
  struct Motion {
    lab::LinkMotion base, tf;
  };
  std::optional<Motion> newest() const;
  /// Which joints it waits for; empty when it does not.
  std::string waiting_for() const;

 private:
  struct Place {  // of a frame against the IMU; without kinematics it is the IMU itself, or fixed to it
    std::optional<lab::LinkKinematics> link;
    std::optional<lab::LinkMotion> newest;
    void take(const JointSample& sample);
  };
  static Place place_of(const std::string& link, const lab::Settings& settings);

  std::string name_, tf_name_;
  mutable std::mutex mutex_;
  Place base_, tf_;
};

}  // namespace kilvo::node
