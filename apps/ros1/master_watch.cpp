#include "apps/ros1/master_watch.hpp"

#include <fmt/core.h>
#include <ros/connection_manager.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/publication.h>
#include <ros/ros.h>
#include <ros/this_node.h>
#include <ros/topic_manager.h>
#include <ros/xmlrpc_manager.h>

namespace kilvo::ros1 {
namespace {

XmlRpc::XmlRpcValue words(const std::vector<std::string>& texts) {
  XmlRpc::XmlRpcValue out;
  for (int i = 0; i < static_cast<int>(texts.size()); ++i) out[i] = texts[static_cast<std::size_t>(i)];
  return out;
}

/// Says something to the master; false when it did not hear.
bool tell(const std::string& what, const std::vector<std::string>& texts, XmlRpc::XmlRpcValue& payload) {
  XmlRpc::XmlRpcValue answer;
  return ros::master::execute(what, words(texts), answer, payload, false);
}

/// What a master says to a node whose topics have publishers: connects to those that are not connected yet.
void connect_to(const std::string& topic, const XmlRpc::XmlRpcValue& publishers, const std::string& own_uri) {
  std::string host;
  std::uint32_t port = 0;
  if (!ros::network::splitURI(own_uri, host, port)) return;
  XmlRpc::XmlRpcValue request, answer;
  request[0] = std::string("/master");
  request[1] = topic;
  request[2] = publishers;
  XmlRpc::XmlRpcClient* self = ros::XMLRPCManager::instance()->getXMLRPCClient(host, static_cast<int>(port), own_uri);
  self->execute("publisherUpdate", request, answer);
  ros::XMLRPCManager::instance()->releaseXMLRPCClient(self);
}

}  // namespace

void MasterWatch::look() {
  const auto now = std::chrono::steady_clock::now();
  if (now - looked_ < std::chrono::seconds(1)) return;
  looked_ = now;
  XmlRpc::XmlRpcValue process;
  if (!tell("getPid", {ros::this_node::getName()}, process)) {
    if (!gone_) ROS_WARN_STREAM("kilvo: the ROS master is gone; going on with the connections that there are");
    gone_ = true;
    return;
  }
  gone_ = false;
  const int pid = static_cast<int>(process);
  if (master_ && *master_ != pid) introduce();
  master_ = pid;
}

void MasterWatch::introduce() const {
  const std::string& name = ros::this_node::getName();
  const std::string uri = ros::XMLRPCManager::instance()->getServerURI();
  XmlRpc::XmlRpcValue payload;
  std::vector<std::string> topics;
  ros::this_node::getAdvertisedTopics(topics);
  for (const std::string& topic : topics) {
    if (const auto publication = ros::TopicManager::instance()->lookupPublication(topic))
      tell("registerPublisher", {name, topic, publication->getDataType(), uri}, payload);
  }
  ros::this_node::getSubscribedTopics(topics);
  for (const std::string& topic : topics) {
    if (tell("registerSubscriber", {name, topic, "*", uri}, payload)) connect_to(topic, payload, uri);
  }
  const std::string service_uri = fmt::format("rosrpc://{}:{}", ros::network::getHost(), ros::ConnectionManager::instance()->getTCPPort());
  for (const std::string& service : services_) tell("registerService", {name, service, service_uri, uri}, payload);
  ROS_INFO_STREAM("kilvo: told a new ROS master of " << topics.size() << " topics");
}

}  // namespace kilvo::ros1
