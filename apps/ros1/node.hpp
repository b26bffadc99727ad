// The node in ROS 1: topics and services around node::Node.
#pragma once

#include <memory>
#include <optional>
#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>
#include <string>
#include <vector>

#include "apps/node/node.hpp"
#include "apps/ros1/master_watch.hpp"
#include "apps/ros1/parameters.hpp"
#include "apps/ros1/ros_inputs.hpp"
#include "apps/ros1/ros_outlet.hpp"

namespace kilvo::ros1 {

class Node {
 public:
  /// Throws lab::ConfigError when the settings make no sense together.
  Node(const Parameters& parameters, const lab::Settings& settings);
  ~Node() { stop(); }
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  /// What goes out at a leisurely pace; to be called about ten times a second.
  void tick();

  /// Takes no more messages; what has come is worked on, and published, first.
  void stop();

 private:
  void offer_services();

  RosOutlet outlet_;
  node::Node node_;
  std::optional<MasterWatch> master_;  // of the thread that ticks
  std::vector<ros::ServiceServer> services_;
  std::optional<RosInputs> inputs_;
  ros::CallbackQueue service_queue_;
  std::unique_ptr<ros::AsyncSpinner> service_spinner_;
};

}  // namespace kilvo::ros1
