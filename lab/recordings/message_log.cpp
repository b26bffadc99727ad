#include "lab/recordings/message_log.hpp"

#include "lab/messages/message_schema.hpp"

namespace kilvo::lab {

void MessageLog::write(const std::string& topic, std::string_view type, Time t, Bytes cdr, std::string_view definition) {
  const std::lock_guard lock(mutex_);
  auto channel = channels_.find(topic);
  if (channel == channels_.end()) {
    const std::string_view text = definition.empty() ? known_definition(type) : definition;
    const auto schema = MessageSchema::parse(type, text);
    Channel added{0, topic, std::string(type), {}, {}, Encoding::cdr};
    if (schema && !text.empty()) added.definition = schema->text(Encoding::cdr);
    channel = channels_.emplace(topic, file_.add_channel(added)).first;
  }
  file_.write(channel->second, t, cdr);
}

void MessageLog::close() {
  const std::lock_guard lock(mutex_);
  file_.close();
}

}  // namespace kilvo::lab
