#include "apps/ros1/ros_inputs.hpp"

#include "apps/ros1/ros_messages.hpp"

namespace kilvo::ros1 {
namespace {

constexpr std::uint32_t most_samples = 2000, most_pictures = 20;  // messages that wait for their thread

}  // namespace

RosInputs::RosInputs(const lab::Settings& settings, node::SensorInputs& inputs)
    : inputs_(inputs), fast_spinner_(1, &fast_queue_), slow_spinner_(1, &slow_queue_) {
  for (const Sensor sensor : all_sensors) {
    if (!settings.has(sensor)) continue;
    const std::string& topic = settings.topic(sensor);
    subscribe(sensor, topic, false);
    if (sensor == Sensor::camera && !topic.ends_with("/compressed")) subscribe(sensor, topic + "/compressed", true);
  }
  fast_spinner_.start();
  slow_spinner_.start();
}

void RosInputs::stop() {
  fast_spinner_.stop();
  slow_spinner_.stop();
  for (ros::Subscriber& subscriber : subscribers_) subscriber.shutdown();
}

void RosInputs::subscribe(Sensor sensor, const std::string& topic, bool is_compressed) {
  const boost::function<void(const Event&)> callback = [this, sensor, is_compressed](const Event& event) {
    const std::string type = lab::plain_type_name(event.getConnectionHeader()["type"]);
    const AnyMessage& message = *event.getConstMessage();
    inputs_.receive(sensor, {type, {message.bytes, lab::Encoding::ros1}, time_of(event.getReceiptTime())}, is_compressed);
  };
  ros::SubscribeOptions options;
  options.initByFullCallbackType<const Event&>(topic, node::is_quick(sensor) ? most_samples : most_pictures, callback);
  options.transport_hints = ros::TransportHints().tcpNoDelay();
  options.callback_queue = node::is_quick(sensor) ? &fast_queue_ : &slow_queue_;
  subscribers_.push_back(node_.subscribe(options));
}

}  // namespace kilvo::ros1
