// What the node is told by its private ROS parameters. What the robot is and how it is estimated stands in the configuration file alone.
#pragma once

#include <array>
#include <ros/node_handle.h>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/node/options.hpp"
#include "apps/node/outlet.hpp"

namespace kilvo::ros1 {

/// A parameter that cannot be used; the text names it.
struct ParameterError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// How the topics are called.
struct Names {
  std::array<std::string, node::topic_count> names;

  Names();
  std::string& of(node::Topic topic) { return names[static_cast<std::size_t>(topic)]; }
  const std::string& of(node::Topic topic) const { return names[static_cast<std::size_t>(topic)]; }
};

struct Parameters {
  std::vector<std::string> overrides;  // KEY=VALUE, as `kilvo run --set`
  Names names;
  node::Options options;
};

/// Throws ParameterError: one missing, unknown, of a wrong type or out of its range.
Parameters read_parameters(const ros::NodeHandle& own);

}  // namespace kilvo::ros1
