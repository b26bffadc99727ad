// The services of the node, as a node of ROS 2 with rmw_cyclonedds has them.
#pragma once

#include <functional>
#include <list>
#include <string>

#include "apps/dds/domain.hpp"
#include "apps/node/node.hpp"

namespace kilvo::dds {

class Services {
 public:
  /// /name/save_map, /name/reset, /name/pause/SENSOR; `node` must outlive it.
  Services(const Domain& domain, const std::string& name, node::Node& node);

  /// Answers who has asked. From one thread, often.
  void look();

 private:
  struct Service {
    Entity requests, replies;
    bool is_set_bool = false;
    std::function<node::Answer(bool)> call;
  };
  void offer(const Domain& domain, const std::string& path, bool is_set_bool, std::function<node::Answer(bool)> call);

  std::list<Service> services_;
};

}  // namespace kilvo::dds
