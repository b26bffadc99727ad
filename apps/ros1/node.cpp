#include "apps/ros1/node.hpp"

#include <ros/ros.h>

#include "apps/ros1/ros_messages.hpp"

namespace kilvo::ros1 {
namespace {

template <class RosAnswer>
bool give(const node::Answer& from, RosAnswer& to) {
  to.success = from.success ? 1 : 0;
  to.message = std::string_view(from.message);
  return true;
}

}  // namespace

Node::Node(const Parameters& parameters, const lab::Settings& settings)
    : outlet_(parameters.names),
      node_(parameters.options, settings, outlet_.outlet(), [](const std::string& text) { ROS_INFO_STREAM("kilvo: " << text); }) {
  inputs_.emplace(settings, node_.inputs());
  offer_services();
  std::vector<std::string> services;
  for (const ros::ServiceServer& service : services_) services.push_back(service.getService());
  master_.emplace(std::move(services));
}

void Node::tick() {
  master_->look();
  node_.tick(time_of(ros::Time::now()));
}

void Node::stop() {
  if (service_spinner_) service_spinner_->stop();
  services_.clear();
  if (inputs_) inputs_->stop();
  node_.stop();
}

void Node::offer_services() {
  ros::NodeHandle own("~");
  own.setCallbackQueue(&service_queue_);
  const auto trigger = [&](const std::string& name, node::Answer (node::Node::*what)()) {
    const boost::function<bool(Trigger&, TriggerAnswer&)> call = [this, what](Trigger&, TriggerAnswer& answer) {
      return give((node_.*what)(), answer);
    };
    services_.push_back(own.advertiseService<Trigger, TriggerAnswer>(name, call));
  };
  trigger("save_map", &node::Node::save_map);
  trigger("reset", &node::Node::reset);
  for (const Sensor sensor : node_.sensors_to_pause()) {
    const boost::function<bool(SetBool&, SetBoolAnswer&)> call = [this, sensor](SetBool& request, SetBoolAnswer& answer) {
      return give(node_.pause(sensor, request.data != 0), answer);
    };
    services_.push_back(own.advertiseService<SetBool, SetBoolAnswer>(std::string("pause/") + name_of(sensor), call));
  }
  service_spinner_ = std::make_unique<ros::AsyncSpinner>(1, &service_queue_);
  service_spinner_->start();
}

}  // namespace kilvo::ros1
