#include "lab/recordings/rosbag1_reader.hpp"

#include <algorithm>

namespace kilvo::lab {
namespace {

constexpr std::size_t most_open_chunks = 64;
constexpr std::size_t most_open_bytes = std::size_t{64} << 20;
constexpr std::size_t most_entries = 1 << 16;  // of one chunk at a time; larger chunks are put in order piece by piece

}  // namespace

/// A chunk that is being read, with the next messages in the order of time.
struct Rosbag1Reader::Cursor {
  BagChunkReader chunk;
  std::vector<BagEntry> entries;
  std::size_t at = 0;

  const BagEntry& head() const { return entries[at]; }
  std::size_t held() const { return chunk.held() + entries.capacity() * sizeof(BagEntry); }
};

Rosbag1Reader::Rosbag1Reader(FileBytes file) : file_(std::make_unique<FileBytes>(std::move(file))), layout_(read_bag_layout(*file_)) {
  learn_connections();
  select([](const BagConnection&) { return true; });
}

Rosbag1Reader::~Rosbag1Reader() = default;
Rosbag1Reader::Rosbag1Reader(Rosbag1Reader&&) noexcept = default;

/// A connection is defined in the chunk where it first appears; the copy at the end of the file is used only for connections that are
/// defined nowhere else, so that damage there cannot rename what came before it. Chunks without an index are read through for times.
void Rosbag1Reader::learn_connections() {
  bool any = false;
  for (BagChunk& chunk : layout_.chunks) {
    if (!chunk.indexed || chunk.new_connections) {
      BagChunkReader reader(*file_, chunk);
      const auto learn = [&](const BagConnection& connection) {
        if (connections_.size() < most_connections) connections_.try_emplace(connection.id, connection);
      };
      std::map<std::uint32_t, TimesSummary> times;
      TimesSummary all;
      while (const auto entry = reader.scan(learn)) {
        all.add(entry->time);
        if (layout_.times.size() + times.size() < most_connections || times.contains(entry->connection))
          times[entry->connection].add(entry->time);
      }
      note(reader.damage());
      if (!chunk.indexed) {
        for (const auto& [connection, summary] : times) layout_.times[connection].append(summary);
        chunk.first = all.first;
        chunk.last = all.last;
        if (all.count == 0) continue;
      }
    }
    begin_ = any ? std::min(begin_, chunk.first) : chunk.first;
    end_ = any ? std::max(end_, chunk.last) : chunk.last;
    any = true;
  }
  for (const auto& [id, connection] : layout_.footer) connections_.try_emplace(id, connection);
}

void Rosbag1Reader::select(const std::function<bool(const BagConnection&)>& wanted, Time from, Time until) {
  selected_.clear();
  for (const auto& [id, connection] : connections_) {
    if (wanted(connection)) selected_.emplace(id, &connection);
  }
  from_ = from;
  until_ = until;
  order_.clear();
  selected_bytes_ = opened_bytes_ = 0;
  for (std::size_t i = 0; i < layout_.chunks.size(); ++i) {
    const BagChunk& chunk = layout_.chunks[i];
    if (chunk.last < from || chunk.first >= until) continue;
    order_.push_back(i);
    selected_bytes_ += chunk.data_size;
  }
  std::ranges::stable_sort(order_, {}, [&](std::size_t i) { return layout_.chunks[i].first; });
  next_chunk_ = 0;
  open_.clear();
  last_ = Time::min();
  late_ = 0;
}

void Rosbag1Reader::note(const std::optional<Damage>& damage) {
  auto& damages = layout_.damages;
  if (!damage || damages.size() >= most_damages) return;
  const auto place = std::ranges::lower_bound(damages, damage->offset, {}, &Damage::offset);
  if (place == damages.end() || place->offset != damage->offset) damages.insert(place, *damage);
}

void Rosbag1Reader::fill(Cursor& cursor) {
  cursor.entries.clear();
  cursor.at = 0;
  while (cursor.entries.size() < most_entries) {
    const auto entry = cursor.chunk.scan();
    if (!entry) break;
    if (entry->time >= from_ && entry->time < until_ && selected_.contains(entry->connection)) cursor.entries.push_back(*entry);
  }
  note(cursor.chunk.damage());
  if (!std::ranges::is_sorted(cursor.entries, {}, &BagEntry::time)) std::ranges::stable_sort(cursor.entries, {}, &BagEntry::time);
}

/// Opens every chunk that may hold a message earlier than the earliest one at hand.
void Rosbag1Reader::open_due_chunks() {
  const auto earlier = [](const auto& a, const auto& b) { return a->head().time < b->head().time; };
  while (next_chunk_ < order_.size()) {
    const BagChunk& chunk = layout_.chunks[order_[next_chunk_]];
    if (!open_.empty()) {
      const auto first = std::ranges::min_element(open_, earlier);
      if ((*first)->head().time < chunk.first) return;
      std::size_t held = chunk.compression == "none" ? 0 : chunk.inflated_size;
      for (const auto& cursor : open_) held += cursor->held();
      if (open_.size() >= most_open_chunks || held > most_open_bytes) return;
    }
    ++next_chunk_;
    opened_bytes_ += chunk.data_size;
    auto cursor = std::make_unique<Cursor>(Cursor{BagChunkReader(*file_, chunk), {}, 0});
    fill(*cursor);
    if (!cursor->entries.empty()) open_.push_back(std::move(cursor));
  }
}

std::optional<RawMessage> Rosbag1Reader::next() {
  // A chunk is left, or read further, when the message before was its last: its bytes had to stay until now.
  for (auto& cursor : open_) {
    if (cursor->at == cursor->entries.size()) fill(*cursor);
  }
  std::erase_if(open_, [](const auto& cursor) { return cursor->entries.empty(); });
  open_due_chunks();
  if (open_.empty()) return std::nullopt;

  const auto earlier = [](const auto& a, const auto& b) { return a->head().time < b->head().time; };
  Cursor& cursor = **std::ranges::min_element(open_, earlier);
  const BagEntry& entry = cursor.head();
  ++cursor.at;
  if (entry.time < last_) ++late_;
  last_ = std::max(last_, entry.time);
  RawMessage message{selected_.at(entry.connection), entry.time, {}, entry.size};
  if (entry.size <= most_message_bytes) message.bytes = cursor.chunk.message(entry);
  return message;
}

}  // namespace kilvo::lab
