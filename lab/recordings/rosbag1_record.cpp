#include "lab/recordings/rosbag1_record.hpp"

#include "lab/messages/ros_time.hpp"

namespace kilvo::lab {
namespace {

struct BagField {
  std::string_view name;
  Bytes value;
};

/// uint32 length, name, '=', value.
std::optional<BagField> read_field(ByteReader& reader) {
  const Bytes field = reader.array();
  const std::string_view text = as_text(field);
  const std::size_t equals = text.find('=');
  if (!reader.ok() || equals == std::string_view::npos) return std::nullopt;
  return BagField{text.substr(0, equals), field.subspan(equals + 1)};
}

template <class T>
bool number(Bytes value, std::optional<T>& to) {
  if (value.size() != sizeof(T)) return false;
  to = ByteReader(value).read<T>();
  return true;
}

bool set(BagRecordHeader& header, const BagField& field) {
  if (field.name == "op") {
    if (field.value.size() != 1) return false;
    header.op = static_cast<BagOp>(field.value[0]);
    return true;
  }
  if (field.name == "conn") return number(field.value, header.connection);
  if (field.name == "time") {
    if (field.value.size() != 8) return false;
    ByteReader reader(field.value);
    header.time = read_ros_time(reader);
    return true;
  }
  if (field.name == "size") return number(field.value, header.size);
  if (field.name == "count") return number(field.value, header.count);
  if (field.name == "chunk_count") return number(field.value, header.chunk_count);
  if (field.name == "index_pos") return number(field.value, header.index_pos);
  if (field.name == "compression") header.compression = as_text(field.value);
  if (field.name == "topic") header.topic = as_text(field.value);
  if (field.name == "encryptor") header.encryptor = as_text(field.value);
  return true;
}

}  // namespace

std::optional<BagRecordHeader> parse_bag_header(Bytes header) {
  BagRecordHeader parsed;
  ByteReader reader(header);
  while (reader.remaining() > 0) {
    const auto field = read_field(reader);
    if (!field || !set(parsed, *field)) return std::nullopt;
  }
  if (!parsed.op) return std::nullopt;
  return parsed;
}

std::optional<Channel> parse_connection(const BagRecordHeader& header, Bytes data) {
  if (!header.connection) return std::nullopt;
  Channel connection;
  connection.id = *header.connection;
  connection.topic = header.topic;
  ByteReader reader(data);
  while (reader.remaining() > 0) {
    const auto field = read_field(reader);
    if (!field) return std::nullopt;
    if (field->name == "type") connection.type = as_text(field->value);
    if (field->name == "md5sum") connection.md5sum = as_text(field->value);
    if (field->name == "message_definition" && field->value.size() <= most_definition_bytes) connection.definition = as_text(field->value);
  }
  return connection.topic.empty() || connection.type.empty() ? std::nullopt : std::optional(std::move(connection));
}

}  // namespace kilvo::lab
