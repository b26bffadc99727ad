#include "lab/recordings/mcap_channels.hpp"

namespace kilvo::lab {
namespace {

Encoding encoding_of(const std::string& name) { return name == "ros1" ? Encoding::ros1 : name == "cdr" ? Encoding::cdr : Encoding::other; }

}  // namespace

void McapChannels::add(McapSchema schema) {
  if (schemas_.size() < most_connections) schemas_.try_emplace(schema.id, std::move(schema));
}

void McapChannels::add(McapChannel channel) {
  if (channels_.size() < most_connections) channels_.try_emplace(channel.id, std::move(channel));
}

void McapChannels::add_schemas(const McapChannels& others) {
  for (const auto& [id, schema] : others.schemas_) add(schema);
}

void McapChannels::add(const McapChannels& others) {
  add_schemas(others);
  for (const auto& [id, channel] : others.channels_) add(channel);
}

Encoding McapChannels::encoding(std::uint16_t channel) const {
  const auto found = channels_.find(channel);
  return found == channels_.end() ? Encoding::other : encoding_of(found->second.encoding);
}

Channel McapChannels::channel(const McapChannel& from) const {
  Channel channel;
  channel.id = from.id;
  channel.topic = from.topic;
  channel.encoding = encoding_of(from.encoding);
  const auto schema = schemas_.find(from.schema);
  if (schema == schemas_.end()) return channel;
  channel.type = plain_type_name(schema->second.name);
  if (schema->second.encoding == "ros1msg" || schema->second.encoding == "ros2msg") channel.definition = schema->second.text;
  return channel;
}

bool McapChannels::has(std::uint16_t channel) const {
  const auto found = channels_.find(channel);
  return found != channels_.end() && (found->second.schema == 0 || schemas_.contains(found->second.schema));
}

std::map<std::uint32_t, Channel> McapChannels::all(bool with_schema) const {
  std::map<std::uint32_t, Channel> all;
  for (const auto& [id, from] : channels_) {
    if (has(id) == with_schema) all.emplace(id, channel(from));
  }
  return all;
}

}  // namespace kilvo::lab
