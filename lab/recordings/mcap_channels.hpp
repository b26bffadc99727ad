// The channels of an MCAP file: what a topic's messages are of.
#pragma once

#include <map>

#include "lab/recordings/mcap_record.hpp"

namespace kilvo::lab {

/// Channels and the schemas that they refer to, in any order.
class McapChannels {
 public:
  void add(McapSchema schema);
  void add(McapChannel channel);
  void add(const McapChannels& others);
  void add_schemas(const McapChannels& others);
  Encoding encoding(std::uint16_t channel) const;
  /// It and its schema, if it has one, are known. (A summary may repeat channels without their schemas.)
  bool has(std::uint16_t channel) const;
  /// Those that are known with their schemas, or the others.
  std::map<std::uint32_t, Channel> all(bool with_schema = true) const;
  Channel channel(const McapChannel& channel) const;

 private:
  std::map<std::uint16_t, McapSchema> schemas_;
  std::map<std::uint16_t, McapChannel> channels_;
};

}  // namespace kilvo::lab
