// The topics of the node in DDS, as a node of ROS 2 has them.
#pragma once

#include <array>
#include <functional>
#include <string>

#include "apps/dds/domain.hpp"
#include "apps/node/outlet.hpp"

namespace kilvo::dds {

class DdsOutlet {
 public:
  /// `name`: of the node; its topics are /name/odometry and so on.
  DdsOutlet(const Domain& domain, const std::string& name);

  /// It must outlive what is returned.
  node::Outlet outlet() const;

  /// Subscribers that ask for what is not offered: each once, as a sentence. From one thread.
  void look_for_misfits(const std::function<void(const std::string&)>& say);

 private:
  void send(node::Topic topic, const std::vector<std::uint8_t>& bytes) const;

  std::array<Entity, node::topic_count> writers_;
  std::array<std::string, node::topic_count> names_;
  std::array<std::uint32_t, node::topic_count> misfits_{};
};

/// "durability", "reliability", ... of a quality of service.
std::string qos_policy_name(std::uint32_t policy);

}  // namespace kilvo::dds
