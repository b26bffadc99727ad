#include "lab/recordings/mcap_writer.hpp"

#include <algorithm>

#include "lab/recordings/deflate.hpp"
#include "lab/recordings/mcap_record.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t most_channels = 65'535;

std::vector<std::uint8_t> record(McapOp op, const ByteWriter& content) {
  ByteWriter out;
  out.reserve(content.size() + mcap_record_head);
  out.put(static_cast<std::uint8_t>(op)).put(static_cast<std::uint64_t>(content.size())).append(content.bytes().data(), content.size());
  return out.take();
}

std::uint64_t ns(Time t) { return static_cast<std::uint64_t>(std::max<std::int64_t>(to_ns(t), 0)); }

const char* name_of(McapWriter::Compression compression) {
  constexpr const char* names[] = {"", "lz4", "zstd"};
  return names[static_cast<int>(compression)];
}

std::vector<std::uint8_t> packed(McapWriter::Compression compression, const std::vector<std::uint8_t>& content) {
  if (compression == McapWriter::Compression::lz4) return deflate_lz4(content);
  if (compression == McapWriter::Compression::zstd) return deflate_zstd(content);
  return content;
}

}  // namespace

McapWriter::McapWriter(const std::filesystem::path& path, Compression compression, const std::string& profile, std::size_t chunk_bytes)
    : name_(path.string()), file_(path, std::ios::binary | std::ios::trunc), compression_(compression), chunk_bytes_(chunk_bytes) {
  if (!file_) throw OutputError(name_ + ": cannot be written");
  put({mcap_magic.begin(), mcap_magic.end()});
  ByteWriter header;
  put(record(McapOp::header, header.put_string(profile).put_string("kilvo")));
}

McapWriter::~McapWriter() {
  try {
    close();
  } catch (const OutputError&) {
    // For those who call close().
  }
}

void McapWriter::put(const std::vector<std::uint8_t>& bytes) {
  file_.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!file_) throw OutputError(name_ + ": cannot be written (disk full?)");
  position_ += bytes.size();
}

std::uint32_t McapWriter::add_channel(const Channel& channel) {
  if (channels_.size() >= most_channels) throw OutputError(name_ + ": more topics than MCAP can have");
  Definition definition;
  const bool ros2 = channel.encoding == Encoding::cdr;
  const std::string key = std::string(lab::name_of(channel.encoding)) + channel.type + "\n" + channel.definition;
  auto known = schemas_.find(key);
  if (!channel.type.empty()) {
    definition.first_of_schema = known == schemas_.end();
    if (definition.first_of_schema) known = schemas_.emplace(key, static_cast<std::uint16_t>(schemas_.size() + 1)).first;
    ByteWriter schema;
    schema.put(known->second).put_string(ros2 ? ros2_type_name(channel.type) : channel.type);
    schema.put_string(channel.definition.empty() ? "" : ros2 ? "ros2msg" : "ros1msg").put_string(channel.definition);
    definition.schema = record(McapOp::schema, schema);
  }
  const auto id = static_cast<std::uint16_t>(channels_.size());
  ByteWriter out;
  out.put(id)
      .put(known == schemas_.end() ? std::uint16_t{0} : known->second)
      .put_string(channel.topic)
      .put_string(lab::name_of(channel.encoding));
  out.put(std::uint32_t{0});  // metadata
  definition.channel = record(McapOp::channel, out);
  channels_.push_back(std::move(definition));
  return id;
}

void McapWriter::write(std::uint32_t channel, Time recorded, Bytes message) {
  Definition& owner = channels_.at(channel);
  if (!owner.written) {
    for (const auto* definition : {&owner.schema, &owner.channel}) content_.append(definition->data(), definition->size());
    owner.written = true;
  }
  const auto id = static_cast<std::uint16_t>(channel);
  index_[id].emplace_back(recorded, content_.size());
  content_.put(static_cast<std::uint8_t>(McapOp::message)).put(static_cast<std::uint64_t>(message.size() + mcap_message_head));
  content_.put(id).put(owner.sequence++).put(ns(recorded)).put(ns(recorded)).append(message.data(), message.size());
  ++owner.count;
  if (content_.size() >= chunk_bytes_) write_chunk();
}

void McapWriter::write_chunk() {
  if (index_.empty()) return;
  const auto content = content_.take();
  const auto body = packed(compression_, content);
  ChunkIndex chunk{position_, 0, Time::max(), Time::min(), {}, 0, body.size(), content.size()};
  for (const auto& [channel, entries] : index_) {
    for (const auto& [time, offset] : entries) {
      chunk.first = std::min(chunk.first, time);
      chunk.last = std::max(chunk.last, time);
    }
  }
  ByteWriter out;
  out.reserve(body.size() + 64);
  out.put(ns(chunk.first)).put(ns(chunk.last)).put(static_cast<std::uint64_t>(content.size())).put(crc32(content));
  out.put_string(name_of(compression_)).put(static_cast<std::uint64_t>(body.size())).append(body.data(), body.size());
  put(record(McapOp::chunk, out));
  chunk.size = position_ - chunk.offset;
  write_indexes(chunk);
  first_ = std::min(first_, chunk.first);
  last_ = std::max(last_, chunk.last);
  chunks_.push_back(std::move(chunk));
}

void McapWriter::write_indexes(ChunkIndex& chunk) {
  for (auto& [channel, entries] : index_) {
    std::ranges::stable_sort(entries, {}, &std::pair<Time, std::uint64_t>::first);
    ByteWriter out;
    out.put(channel).put(static_cast<std::uint32_t>(entries.size() * 16));
    for (const auto& [time, offset] : entries) out.put(ns(time)).put(offset);
    chunk.index_offsets[channel] = position_;
    put(record(McapOp::message_index, out));
  }
  chunk.index_size = position_ - chunk.offset - chunk.size;
  index_.clear();
}

void McapWriter::flush() {
  write_chunk();
  file_.flush();
  if (!file_) throw OutputError(name_ + ": cannot be written (disk full?)");
}

/// Definitions, statistics, an index of the chunks, and where each of these begins, from the file's byte `begin` on.
std::vector<std::uint8_t> McapWriter::summary(std::uint64_t begin) const {
  ByteWriter all, offsets;
  const auto group = [&](McapOp op, const auto& write) {
    const std::size_t from = all.size();
    write();
    if (all.size() == from) return;
    ByteWriter out;
    out.put(static_cast<std::uint8_t>(op)).put(begin + from).put(static_cast<std::uint64_t>(all.size() - from));
    const auto bytes = record(McapOp::summary_offset, out);
    offsets.append(bytes.data(), bytes.size());
  };
  const auto add = [&](const std::vector<std::uint8_t>& bytes) { all.append(bytes.data(), bytes.size()); };
  group(McapOp::schema, [&] {
    for (const Definition& d : channels_) {
      if (d.first_of_schema) add(d.schema);
    }
  });
  group(McapOp::channel, [&] {
    for (const Definition& d : channels_) add(d.channel);
  });
  group(McapOp::statistics, [&] {
    ByteWriter out, counts;
    std::uint64_t messages = 0;
    for (std::size_t id = 0; id < channels_.size(); ++id) {
      messages += channels_[id].count;
      if (channels_[id].count > 0) counts.put(static_cast<std::uint16_t>(id)).put(channels_[id].count);
    }
    const bool any = !chunks_.empty();
    out.put(messages).put(static_cast<std::uint16_t>(schemas_.size())).put(static_cast<std::uint32_t>(channels_.size()));
    out.put(std::uint32_t{0}).put(std::uint32_t{0}).put(static_cast<std::uint32_t>(chunks_.size()));  // attachments, metadata, chunks
    out.put(any ? ns(first_) : 0).put(any ? ns(last_) : 0).put(static_cast<std::uint32_t>(counts.size()));
    add(record(McapOp::statistics, out.append(counts.bytes().data(), counts.size())));
  });
  group(McapOp::chunk_index, [&] {
    for (const ChunkIndex& chunk : chunks_) {
      ByteWriter out;
      out.put(ns(chunk.first)).put(ns(chunk.last)).put(chunk.offset).put(chunk.size);
      out.put(static_cast<std::uint32_t>(chunk.index_offsets.size() * 10));
      for (const auto& [channel, offset] : chunk.index_offsets) out.put(channel).put(offset);
      out.put(chunk.index_size).put_string(name_of(compression_)).put(chunk.compressed).put(chunk.inflated);
      add(record(McapOp::chunk_index, out));
    }
  });
  const std::uint64_t offsets_begin = begin + all.size();
  add(offsets.bytes());
  // The footer: the checksum is over all of the summary and the footer before it.
  all.put(static_cast<std::uint8_t>(McapOp::footer)).put(std::uint64_t{20}).put(begin).put(offsets_begin);
  all.put(crc32(all.bytes())).append(mcap_magic.data(), mcap_magic.size());
  return all.take();
}

void McapWriter::close() {
  if (closed_) return;
  closed_ = true;
  write_chunk();
  put(record(McapOp::data_end, ByteWriter().put(std::uint32_t{0})));
  put(summary(position_));
  file_.close();
  if (file_.fail()) throw OutputError(name_ + ": cannot be written (disk full?)");
}

}  // namespace kilvo::lab
