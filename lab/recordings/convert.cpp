#include "lab/recordings/convert.hpp"

#include <algorithm>
#include <memory>

#include "lab/messages/message_schema.hpp"
#include "lab/recordings/topic_choice.hpp"

namespace kilvo::lab {
namespace {

/// What becomes of the messages of one channel.
struct Route {
  std::uint32_t id = 0;
  std::optional<MessageSchema> schema;  // to re-encode with; else they are copied
  std::uint64_t unfit = 0;
  std::string first_fault;
};

class Conversion {
 public:
  Conversion(RecordingReader& from, MessageWriter& to, const ConvertOptions& options) : from_(from), to_(to), options_(options) {
    for (const auto& [id, channel] : from.connections()) {
      if (is_wanted(channel)) add(channel);
    }
    for (const std::string& topic : options.topics) {
      const auto named = [&](const auto& entry) { return without_slash(entry.second.topic) == without_slash(topic); };
      if (std::ranges::none_of(from.connections(), named)) report_.warnings.push_back("no topic " + topic + " in " + from.name());
    }
  }

  ConvertReport all(const std::function<bool(double)>& keep_going) {
    constexpr double for_ever = 1e9;  // s
    const Time begin = from_.begin() + from_seconds(std::clamp(options_.start, 0.0, for_ever));
    from_.select([&](const Channel& channel) { return routes_.contains(channel.id); }, options_.start > 0 ? begin : Time::min(),
                 options_.duration < for_ever ? begin + from_seconds(options_.duration) : Time::max());
    while (const auto message = from_.next()) {
      write(*message);
      if (!keep_going(from_.progress())) break;
    }
    for (const auto& [id, route] : routes_) {
      if (route.unfit == 0) continue;
      const std::string& topic = from_.connections().at(id).topic;
      report_.warnings.push_back(topic + ": " + std::to_string(route.unfit) + " messages left out; the first: " + route.first_fault);
    }
    report_.damages = from_.damages();
    return std::move(report_);
  }

 private:
  bool is_wanted(const Channel& channel) const {
    const auto named = [&](const std::string& topic) { return without_slash(topic) == without_slash(channel.topic); };
    return options_.topics.empty() || std::ranges::any_of(options_.topics, named);
  }

  void add(const Channel& channel) {
    Channel out = channel;
    Route route;
    const std::string_view known = known_definition(channel.type);
    auto schema = MessageSchema::parse(channel.type, channel.definition.empty() ? known : std::string_view(channel.definition));
    // What some recordings have in place of a definition is none.
    if ((!schema || schema->types().front().fields.empty()) && !known.empty()) schema = MessageSchema::parse(channel.type, known);
    const bool has_definition = schema && !(channel.definition.empty() && known.empty());
    if (channel.encoding != options_.encoding) {
      if (channel.encoding == Encoding::other || !has_definition)
        return foreign(channel, schema ? "the recording has no definition of its type" : schema.reason());
      out.encoding = options_.encoding;
      route.schema = *schema;
    }
    if (has_definition) {
      if (channel.encoding != options_.encoding || channel.definition.empty()) out.definition = schema->text(options_.encoding);
      if (options_.encoding == Encoding::ros1 && (out.md5sum.empty() || channel.encoding != options_.encoding)) out.md5sum = schema->md5();
    }
    if (options_.encoding == Encoding::ros1 && out.md5sum.empty()) out.md5sum.assign(1, '*');
    route.id = to_.add_channel(out);
    routes_.emplace(channel.id, std::move(route));
  }

  void foreign(const Channel& channel, const std::string& why) {
    if (!options_.keep_foreign) {
      report_.warnings.push_back(channel.topic + " (" + channel.type + ", " + name_of(channel.encoding) + ") left out: " + why);
      return;
    }
    report_.warnings.push_back(channel.topic + " (" + channel.type + ") stays " + name_of(channel.encoding) + ": " + why);
    routes_.emplace(channel.id, Route{to_.add_channel(channel), std::nullopt, 0, {}});
  }

  void write(const RawMessage& message) {
    Route& route = routes_.at(message.connection->id);
    const auto leave_out = [&](const std::string& why) {
      if (route.unfit++ == 0) route.first_fault = why;
    };
    if (message.size > most_message_bytes) return leave_out("larger than 64 MB");
    if (!route.schema) {
      to_.write(route.id, message.time, message.bytes);
      ++report_.messages;
      return;
    }
    const auto bytes = route.schema->convert(message.wire(), options_.encoding);
    if (!bytes) return leave_out(bytes.reason());
    to_.write(route.id, message.time, *bytes);
    ++report_.messages;
  }

  RecordingReader& from_;
  MessageWriter& to_;
  const ConvertOptions& options_;
  std::map<std::uint32_t, Route> routes_;
  ConvertReport report_;
};

}  // namespace

ConvertReport convert_recording(RecordingReader& from, MessageWriter& to, const ConvertOptions& options,
                                const std::function<bool(double)>& keep_going) {
  return Conversion(from, to, options).all(keep_going);
}

}  // namespace kilvo::lab
