#include "apps/dds/domain.hpp"

#include <algorithm>
#include <cstdlib>
#include <dds/dds.h>
#include <fmt/core.h>
#include <ifaddrs.h>
#include <net/if.h>

namespace kilvo::dds {
namespace {

bool is_loopback(const std::string& interface) {
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return false;
  bool found = interface.starts_with("127.");
  for (const ifaddrs* i = all; i != nullptr; i = i->ifa_next)
    found = found || (interface == i->ifa_name && (i->ifa_flags & IFF_LOOPBACK) != 0);
  freeifaddrs(all);
  return found;
}

void require_plain(const std::string& text, const char* what) {
  const auto is_usual = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
           std::string_view(".:-_%@[]").find(c) != std::string_view::npos;
  };
  if (text.empty() || !std::ranges::all_of(text, is_usual)) throw DdsError(fmt::format("{} '{}' is none", what, text));
}

}  // namespace

std::string domain_xml(const DomainOptions& options) {
  std::string general, discovery = "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>40</MaxAutoParticipantIndex>";
  if (!options.interface.empty()) {
    require_plain(options.interface, "the network interface");
    const bool by_address = options.interface.find_first_not_of("0123456789.") == std::string::npos;
    // The kernel does not call the loopback interface one for multicast, yet it is.
    general += fmt::format("<Interfaces><NetworkInterface {}=\"{}\"{}/></Interfaces>", by_address ? "address" : "name", options.interface,
                           is_loopback(options.interface) && options.peers.empty() ? " multicast=\"true\"" : "");
  }
  if (!options.peers.empty()) {
    general += "<AllowMulticast>false</AllowMulticast>";
    // Others learn of this one by its announcements alone: a peer that starts again waits for the next.
    discovery += "<SPDPInterval>400ms</SPDPInterval><Peers>";
    for (const std::string& peer : options.peers) {
      require_plain(peer, "the peer");
      discovery += fmt::format("<Peer Address=\"{}\"/>", peer);
    }
    discovery += "</Peers>";
  }
  const char* given = std::getenv("CYCLONEDDS_URI");
  return fmt::format("{}{}<CycloneDDS><Domain Id=\"any\"><General>{}</General><Discovery>{}</Discovery></Domain></CycloneDDS>",
                     given == nullptr ? "" : given, given == nullptr || *given == '\0' ? "" : ",", general, discovery);
}

Entity::Entity(Handle handle, const std::string& what) : handle_(handle) {
  if (handle < 0) {
    handle_ = 0;
    throw DdsError(fmt::format("DDS: {}: {}", what, dds_strretcode(handle)));
  }
}

Entity::~Entity() {
  if (handle_ > 0) dds_delete(handle_);
}

Qos make_qos(const QosChoice& choice) {
  Qos qos(dds_create_qos(), dds_delete_qos);
  dds_qset_reliability(qos.get(), choice.is_reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, DDS_MSECS(10));
  dds_qset_durability(qos.get(), choice.is_kept_for_latecomers ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, choice.depth);
  dds_qset_writer_data_lifecycle(qos.get(), false);
  if (!choice.user_data.empty()) dds_qset_userdata(qos.get(), choice.user_data.data(), choice.user_data.size());
  return qos;
}

Domain::Domain(const DomainOptions& options)
    : domain_(dds_create_domain(static_cast<dds_domainid_t>(options.domain), domain_xml(options).c_str()),
              fmt::format("domain {} on the interface '{}' cannot be entered (the lines above say why)", options.domain,
                          options.interface.empty() ? "any" : options.interface)) {
  const Qos qos = make_qos({.user_data = "enclave=/;"});
  participant_ = Entity(dds_create_participant(static_cast<dds_domainid_t>(options.domain), qos.get(), nullptr), "a participant");
}

Entity Domain::make_reader(const std::string& topic, const DdsType& type, const QosChoice& choice) const {
  // A topic of its own for each: two types may stand on one name while a robot changes its driver.
  const Entity::Handle t = dds_create_topic(participant(), type.layout, topic.c_str(), nullptr, nullptr);
  if (t < 0) throw DdsError(fmt::format("DDS: topic {}: {}", topic, dds_strretcode(t)));
  Entity reader(dds_create_reader(participant(), t, make_qos(choice).get(), nullptr), "a reader of " + topic);
  dds_delete(t);
  return reader;
}

Entity Domain::make_writer(const std::string& topic, const DdsType& type, const QosChoice& choice) const {
  const Entity::Handle t = dds_create_topic(participant(), type.layout, topic.c_str(), nullptr, nullptr);
  if (t < 0) throw DdsError(fmt::format("DDS: topic {}: {}", topic, dds_strretcode(t)));
  Entity writer(dds_create_writer(participant(), t, make_qos(choice).get(), nullptr), "a writer of " + topic);
  dds_delete(t);
  return writer;
}

}  // namespace kilvo::dds
