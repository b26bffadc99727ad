#include "lab/recordings/rosbag1_writer.hpp"

#include <algorithm>

#include "lab/recordings/deflate.hpp"
#include "lab/recordings/rosbag1_record.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t bag_header_bytes = 4096;  // record with padding, so that it can be written again at the end

/// The header of a record in the making.
class Header {
 public:
  explicit Header(BagOp op) { field("op", static_cast<std::uint8_t>(op)); }

  template <class T>
  Header& field(std::string_view name, T value) {
    fields_.put(static_cast<std::uint32_t>(name.size() + 1 + sizeof value)).append(name.data(), name.size()).put('=').put(value);
    return *this;
  }
  Header& text(std::string_view name, std::string_view value) {
    fields_.put(static_cast<std::uint32_t>(name.size() + 1 + value.size())).append(name.data(), name.size()).put('=');
    fields_.append(value.data(), value.size());
    return *this;
  }
  Header& time(std::string_view name, Time value) {
    fields_.put(static_cast<std::uint32_t>(name.size() + 9)).append(name.data(), name.size()).put('=').put_time(value);
    return *this;
  }

  /// The whole record.
  std::vector<std::uint8_t> with(Bytes data) const {
    ByteWriter record;
    record.reserve(fields_.size() + data.size() + 8);
    record.put(static_cast<std::uint32_t>(fields_.size())).append(fields_.bytes().data(), fields_.size());
    record.put(static_cast<std::uint32_t>(data.size())).append(data.data(), data.size());
    return record.take();
  }

 private:
  ByteWriter fields_;
};

std::vector<std::uint8_t> connection_record(std::uint32_t id, const Channel& channel) {
  ByteWriter data;
  const auto text = [&](std::string_view name, std::string_view value) {
    data.put(static_cast<std::uint32_t>(name.size() + 1 + value.size())).append(name.data(), name.size()).put('=');
    data.append(value.data(), value.size());
  };
  text("topic", channel.topic);
  text("type", channel.type);
  text("md5sum", channel.md5sum);
  text("message_definition", channel.definition);
  return Header(BagOp::connection).field("conn", id).text("topic", channel.topic).with(data.bytes());
}

}  // namespace

Rosbag1Writer::Rosbag1Writer(const std::filesystem::path& path, Compression compression, std::size_t chunk_bytes)
    : name_(path.string()), file_(path, std::ios::binary | std::ios::trunc), compression_(compression), chunk_bytes_(chunk_bytes) {
  if (!file_) throw OutputError(name_ + ": cannot be written");
  file_.write(bag_magic.data(), static_cast<std::streamsize>(bag_magic.size()));
  position_ = bag_magic.size();
  write_bag_header(0);
}

Rosbag1Writer::~Rosbag1Writer() {
  try {
    close();
  } catch (const OutputError&) {
    // For those who call close().
  }
}

void Rosbag1Writer::put(const std::vector<std::uint8_t>& bytes) {
  file_.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!file_) throw OutputError(name_ + ": cannot be written (disk full?)");
  position_ += bytes.size();
}

void Rosbag1Writer::write_bag_header(std::uint64_t index_pos) {
  Header header(BagOp::bag_header);
  header.field("index_pos", index_pos);
  header.field("conn_count", static_cast<std::uint32_t>(connections_.size()));
  header.field("chunk_count", static_cast<std::uint32_t>(chunks_.size()));
  const std::size_t unpadded = header.with({}).size();
  const std::vector<std::uint8_t> padding(bag_header_bytes - unpadded, ' ');
  put(header.with(padding));
}

std::uint32_t Rosbag1Writer::add_connection(const std::string& topic, const MessageType& type) {
  return add_channel({0, topic, std::string(type.name), std::string(type.md5sum), std::string(type.definition), Encoding::ros1});
}

std::uint32_t Rosbag1Writer::add_channel(const Channel& channel) {
  if (channel.encoding != Encoding::ros1) throw OutputError(name_ + ": a ROS 1 bag holds messages of ROS 1 only");
  connections_.push_back({channel, false});
  return static_cast<std::uint32_t>(connections_.size() - 1);
}

void Rosbag1Writer::write(std::uint32_t connection, Time recorded, Bytes message) {
  Connection& owner = connections_.at(connection);
  if (!owner.defined) {
    const auto record = connection_record(connection, owner.channel);
    content_.append(record.data(), record.size());
    owner.defined = true;
  }
  index_[connection].push_back({recorded, static_cast<std::uint32_t>(content_.size())});
  const auto record = Header(BagOp::message).field("conn", connection).time("time", recorded).with(message);
  content_.append(record.data(), record.size());
  if (content_.size() >= chunk_bytes_) write_chunk();
}

void Rosbag1Writer::write_chunk() {
  if (index_.empty()) return;
  const auto content = content_.take();
  ChunkInfo info{position_, Time::max(), Time::min(), {}};
  const bool packed = compression_ == Compression::lz4;
  Header header(BagOp::chunk);
  header.text("compression", packed ? "lz4" : "none").field("size", static_cast<std::uint32_t>(content.size()));
  put(header.with(packed ? deflate_lz4(content) : content));
  for (const auto& [connection, entries] : index_) {
    ByteWriter data;
    for (const auto& entry : entries) {
      data.put_time(entry.time).put(entry.offset);
      info.first = std::min(info.first, entry.time);
      info.last = std::max(info.last, entry.time);
    }
    const auto count = static_cast<std::uint32_t>(entries.size());
    info.counts[connection] = count;
    put(Header(BagOp::index).field("ver", std::uint32_t{1}).field("conn", connection).field("count", count).with(data.bytes()));
  }
  chunks_.push_back(std::move(info));
  index_.clear();
}

void Rosbag1Writer::flush() {
  write_chunk();
  file_.flush();
  if (!file_) throw OutputError(name_ + ": cannot be written (disk full?)");
}

void Rosbag1Writer::close() {
  if (closed_) return;
  closed_ = true;
  write_chunk();
  const std::uint64_t index_pos = position_;
  for (std::uint32_t id = 0; id < connections_.size(); ++id) put(connection_record(id, connections_[id].channel));
  for (const auto& chunk : chunks_) {
    ByteWriter data;
    for (const auto& [connection, count] : chunk.counts) data.put(connection).put(count);
    Header header(BagOp::chunk_info);
    header.field("ver", std::uint32_t{1}).field("chunk_pos", chunk.offset).time("start_time", chunk.first).time("end_time", chunk.last);
    put(header.field("count", static_cast<std::uint32_t>(chunk.counts.size())).with(data.bytes()));
  }
  file_.seekp(static_cast<std::streamoff>(bag_magic.size()));
  write_bag_header(index_pos);
  file_.close();
  if (file_.fail()) throw OutputError(name_ + ": cannot be written (disk full?)");
}

}  // namespace kilvo::lab
