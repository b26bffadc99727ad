// A node of ROS 2 around node::Node. An example: it is not built or tested in this project, which `kilvo live` serves without ROS 2.
//
//   ros2 run kilvo_ros2 kilvo_ros2 --ros-args -p config:=my_robot.yaml
#include <memory>
#include <rclcpp/rclcpp.hpp>
#include <rclcpp/serialized_message.hpp>
#include <string>
#include <vector>

#include "apps/node/node.hpp"

namespace {

using namespace kilvo;

std::string ros2_name(const char* plain) {
  const std::string name = plain;
  return name.substr(0, name.find('/')) + "/msg/" + name.substr(name.find('/') + 1);
}

class Ros2Node : public rclcpp::Node {
 public:
  Ros2Node() : rclcpp::Node("kilvo") {
    node::Options options;
    options.config = declare_parameter<std::string>("config", "");
    options.base = declare_parameter<std::string>("base", "");
    const lab::Settings settings = node::load_settings(options.config, {});
    for (std::size_t i = 0; i < publishers_.size(); ++i) {
      const std::string name = node::topic_facts[i].name;
      publishers_[i] =
          create_generic_publisher(name.front() == '/' ? name : "~/" + name, ros2_name(node::topic_facts[i].type), rclcpp::QoS(10));
    }
    kilvo_ = std::make_unique<node::Node>(options, settings, outlet(),
                                          [this](const std::string& text) { RCLCPP_INFO(get_logger(), "%s", text.c_str()); });
    for (const Sensor sensor : all_sensors) {
      if (settings.has(sensor)) subscribe(sensor, settings.topic(sensor));
    }
    timer_ = create_wall_timer(std::chrono::milliseconds(100), [this] { kilvo_->tick(time_from_ns(now().nanoseconds())); });
  }
  ~Ros2Node() override { kilvo_->stop(); }

 private:
  node::Outlet outlet() {
    const auto at = [this](node::Topic topic) { return publishers_[static_cast<std::size_t>(topic)]; };
    return {lab::Encoding::cdr, [at](node::Topic topic) { return at(topic)->get_subscription_count() > 0; },
            [at](node::Topic topic, Time, const std::vector<std::uint8_t>& bytes) {
              rclcpp::SerializedMessage message(bytes.size());
              auto& raw = message.get_rcl_serialized_message();
              std::copy(bytes.begin(), bytes.end(), raw.buffer);
              raw.buffer_length = bytes.size();
              at(topic)->publish(message);
            }};
  }

  // The usual type of each sensor; one thread runs all callbacks.
  void subscribe(Sensor sensor, const std::string& topic) {
    static constexpr const char* types[] = {"sensor_msgs/Imu", "sensor_msgs/JointState", "sensor_msgs/PointCloud2", "sensor_msgs/Image"};
    const char* type = types[static_cast<std::size_t>(sensor)];
    const auto take = [this, sensor, type](std::shared_ptr<rclcpp::SerializedMessage> message) {
      const auto& raw = message->get_rcl_serialized_message();
      const lab::Bytes bytes(raw.buffer, raw.buffer_length);
      kilvo_->inputs().receive(sensor, {type, {bytes, lab::Encoding::cdr}, time_from_ns(now().nanoseconds())});
    };
    subscriptions_.push_back(create_generic_subscription(topic, ros2_name(type), rclcpp::SensorDataQoS().keep_last(500), take));
  }

  std::array<rclcpp::GenericPublisher::SharedPtr, node::topic_count> publishers_;
  std::unique_ptr<node::Node> kilvo_;
  std::vector<rclcpp::GenericSubscription::SharedPtr> subscriptions_;
  rclcpp::TimerBase::SharedPtr timer_;
};

}  // namespace

int main(int argc, char** argv) {
  rclcpp::init(argc, argv);
  rclcpp::spin(std::make_shared<Ros2Node>());
  rclcpp::shutdown();
  return 0;
}
