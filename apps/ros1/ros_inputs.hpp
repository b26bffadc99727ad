// The topics that the configuration names, in ROS 1: messages of any type, for node::SensorInputs to judge.
#pragma once

#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>
#include <string>
#include <vector>

#include "apps/node/sensor_inputs.hpp"
#include "apps/ros1/any_message.hpp"

namespace kilvo::ros1 {

class RosInputs {
 public:
  /// Subscribes the sensors that the settings have; `inputs` must outlive it.
  RosInputs(const lab::Settings& settings, node::SensorInputs& inputs);
  ~RosInputs() { stop(); }
  RosInputs(const RosInputs&) = delete;
  RosInputs& operator=(const RosInputs&) = delete;

  /// Nothing is received afterwards.
  void stop();

 private:
  using Event = ros::MessageEvent<const AnyMessage>;
  void subscribe(Sensor sensor, const std::string& topic, bool is_compressed);

  node::SensorInputs& inputs_;
  ros::NodeHandle node_;
  ros::CallbackQueue fast_queue_, slow_queue_;
  ros::AsyncSpinner fast_spinner_, slow_spinner_;
  std::vector<ros::Subscriber> subscribers_;
};

}  // namespace kilvo::ros1
