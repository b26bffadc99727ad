#include "apps/dds/dds_outlet.hpp"

#include <dds/dds.h>
#include <dds/ddsi/ddsi_cdrstream.h>
#include <fmt/core.h>

namespace kilvo::dds {
namespace {

QosChoice choice_of(node::Topic topic, const DdsType& type) {
  QosChoice out{.is_reliable = true, .depth = 10, .user_data = fmt::format("typehash=RIHS01_{};", type.ros_hash)};
  using enum node::Topic;
  // A tenth of a second of the fast ones, so that a reader that is busy for some milliseconds misses none.
  if (topic == transforms || topic == odometry || topic == smooth || topic == contacts) out.depth = 100;
  if (topic == path) {
    out.depth = 1;
    out.is_kept_for_latecomers = true;
  }
  return out;
}

}  // namespace

std::string qos_policy_name(std::uint32_t policy) {
  switch (policy) {
    case DDS_DURABILITY_QOS_POLICY_ID:
      return "durability";
    case DDS_RELIABILITY_QOS_POLICY_ID:
      return "reliability";
    case DDS_DEADLINE_QOS_POLICY_ID:
      return "deadline";
    case DDS_LIVELINESS_QOS_POLICY_ID:
      return "liveliness";
    case DDS_OWNERSHIP_QOS_POLICY_ID:
      return "ownership";
    case DDS_DATA_REPRESENTATION_QOS_POLICY_ID:
      return "data representation";
    case DDS_PARTITION_QOS_POLICY_ID:
      return "partition";
    default:
      return fmt::format("policy {}", policy);
  }
}

DdsOutlet::DdsOutlet(const Domain& domain, const std::string& name) {
  for (std::size_t i = 0; i < writers_.size(); ++i) {
    const node::TopicFacts& facts = node::topic_facts[i];
    const std::string own = facts.name;
    names_[i] = own.starts_with('/') ? own : "/" + name + "/" + own;
    const DdsType& type = *find_type(facts.type);
    writers_[i] = domain.make_writer(dds_topic(names_[i]), type, choice_of(static_cast<node::Topic>(i), type));
  }
}

node::Outlet DdsOutlet::outlet() const {
  const auto is_wanted = [this](node::Topic topic) {
    dds_publication_matched_status_t status{};
    return dds_get_publication_matched_status(writers_[static_cast<std::size_t>(topic)].get(), &status) == DDS_RETCODE_OK &&
           status.current_count > 0;
  };
  return {lab::Encoding::cdr, is_wanted, [this](node::Topic topic, Time, const std::vector<std::uint8_t>& bytes) { send(topic, bytes); }};
}

// Cyclone DDS 0.10 writes structs of C: it reads one from the bytes first. A slow reader costs it what it has missed, never the one who
// writes.
void DdsOutlet::send(node::Topic topic, const std::vector<std::uint8_t>& bytes) const {
  constexpr std::uint32_t xcdr1 = 1;
  constexpr std::size_t encapsulation = 4;
  const dds_topic_descriptor_t& layout = *find_type(node::facts_of(topic).type)->layout;
  std::vector<char> sample(layout.m_size);
  dds_istream_t stream{bytes.data() + encapsulation, static_cast<std::uint32_t>(bytes.size() - encapsulation), 0, xcdr1};
  dds_stream_read(&stream, sample.data(), layout.m_ops);
  dds_write(writers_[static_cast<std::size_t>(topic)].get(), sample.data());
  dds_stream_free_sample(sample.data(), layout.m_ops);
}

void DdsOutlet::look_for_misfits(const std::function<void(const std::string&)>& say) {
  for (std::size_t i = 0; i < writers_.size(); ++i) {
    dds_offered_incompatible_qos_status_t status{};
    if (dds_get_offered_incompatible_qos_status(writers_[i].get(), &status) != DDS_RETCODE_OK || status.total_count == misfits_[i])
      continue;
    misfits_[i] = status.total_count;
    say(fmt::format("{}: a subscriber asks for another {} than the topic has (reliable, volatile), and gets nothing", names_[i],
                    qos_policy_name(status.last_policy_id)));
  }
}

}  // namespace kilvo::dds
