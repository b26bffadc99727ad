// Where the messages of a node go: ROS 1, DDS, a log file.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "lab/messages/wire_writer.hpp"

namespace kilvo::node {

/// What a node publishes.
enum class Topic : std::uint8_t { odometry, smooth, transforms, path, cloud, coloured, contacts, ground, diagnostics };
inline constexpr int topic_count = 9;

struct TopicFacts {
  const char* name;  // below the node's own name; with a slash: for all
  const char* type;
};
inline constexpr std::array<TopicFacts, topic_count> topic_facts{{{"odometry", "nav_msgs/Odometry"},
                                                                  {"odometry_smooth", "nav_msgs/Odometry"},
                                                                  {"/tf", "tf2_msgs/TFMessage"},
                                                                  {"path", "nav_msgs/Path"},
                                                                  {"cloud", "sensor_msgs/PointCloud2"},
                                                                  {"cloud_coloured", "sensor_msgs/PointCloud2"},
                                                                  {"contacts", "sensor_msgs/JointState"},
                                                                  {"ground", "geometry_msgs/PoseArray"},
                                                                  {"/diagnostics", "diagnostic_msgs/DiagnosticArray"}}};
constexpr const TopicFacts& facts_of(Topic topic) { return topic_facts[static_cast<std::size_t>(topic)]; }

/// Its functions may be called by several threads at once.
struct Outlet {
  lab::Encoding encoding = lab::Encoding::cdr;
  std::function<bool(Topic)> is_wanted;                                           // somebody listens
  std::function<void(Topic, Time stamp, const std::vector<std::uint8_t>&)> send;  // one message

  template <class Message>
  void publish(Topic topic, Time stamp, const Message& message) const {
    send(topic, stamp, lab::write_message(message, encoding));
  }
};

/// What goes to two places that want the same encoding.
inline Outlet both(Outlet a, Outlet b) {
  return {a.encoding, [a, b](Topic topic) { return a.is_wanted(topic) || b.is_wanted(topic); },
          [a, b](Topic topic, Time stamp, const std::vector<std::uint8_t>& bytes) {
            if (a.is_wanted(topic)) a.send(topic, stamp, bytes);
            if (b.is_wanted(topic)) b.send(topic, stamp, bytes);
          }};
}

}  // namespace kilvo::node
