#include "apps/ros1/ros_outlet.hpp"

#include <ros/names.h>

#include "apps/ros1/any_message.hpp"
#include "apps/ros1/ros_messages.hpp"

namespace kilvo::ros1 {
namespace {

namespace traits = ros::message_traits;

template <class Message>
ros::Publisher advertise(const std::string& topic, std::uint32_t most_unsent, bool latched = false) {
  ros::AdvertiseOptions options(ros::names::resolve(topic), most_unsent, traits::MD5Sum<Message>::value(),
                                traits::DataType<Message>::value(), traits::Definition<Message>::value());
  options.latch = latched;
  return ros::NodeHandle().advertise(options);
}

}  // namespace

RosOutlet::RosOutlet(const Names& names) {
  constexpr std::uint32_t states = 2000, clouds = 4, few = 100;  // two seconds of the states
  const auto at = [&](node::Topic topic) -> ros::Publisher& { return publishers_[static_cast<std::size_t>(topic)]; };
  using enum node::Topic;
  at(odometry) = advertise<OdometryMessage>(names.of(odometry), states);
  at(smooth) = advertise<OdometryMessage>(names.of(smooth), states);
  at(contacts) = advertise<JointMessage>(names.of(contacts), states);
  at(ground) = advertise<PosesMessage>(names.of(ground), few);
  at(path) = advertise<PathMessage>(names.of(path), 1, true);  // who comes late gets the last one
  at(transforms) = advertise<TransformsMessage>(names.of(transforms), few);
  at(cloud) = advertise<CloudMessage>(names.of(cloud), clouds);
  at(coloured) = advertise<CloudMessage>(names.of(coloured), clouds);
  at(diagnostics) = advertise<DiagnosticsMessage>(names.of(diagnostics), few);
}

node::Outlet RosOutlet::outlet() const {
  const auto at = [this](node::Topic topic) -> const ros::Publisher& { return publishers_[static_cast<std::size_t>(topic)]; };
  return {lab::Encoding::ros1, [at](node::Topic topic) { return at(topic).getNumSubscribers() > 0; },
          [at](node::Topic topic, Time, const std::vector<std::uint8_t>& bytes) { at(topic).publish(AnyMessage{bytes}); }};
}

}  // namespace kilvo::ros1
