#include "lab/recordings/chunked_reader.hpp"

#include <algorithm>

namespace kilvo::lab {
namespace {

constexpr std::size_t most_open_chunks = 64;
constexpr std::size_t most_open_bytes = std::size_t{64} << 20;
constexpr std::size_t most_entries = 1 << 16;  // of one chunk at a time; larger chunks are put in order piece by piece

}  // namespace

/// A chunk that is being read, with the next messages in the order of time.
struct ChunkedReader::Cursor {
  std::unique_ptr<ChunkReader> chunk;
  std::vector<MessageEntry> entries;
  std::size_t at = 0;

  const MessageEntry& head() const { return entries[at]; }
  std::size_t held() const { return chunk->held() + entries.capacity() * sizeof(MessageEntry); }
};

ChunkedReader::ChunkedReader(FileBytes file) : file_(std::make_unique<FileBytes>(std::move(file))) {}
ChunkedReader::~ChunkedReader() = default;
ChunkedReader::ChunkedReader(ChunkedReader&&) noexcept = default;

/// A channel is defined in the chunk where it first appears; a copy at the end of the file is used only for channels that are defined
/// nowhere else, so that damage there cannot rename what came before it.
void ChunkedReader::start(Found found) {
  spans_ = std::move(found.spans);
  times_ = std::move(found.times);
  damages_ = std::move(found.damages);
  connections_ = std::move(found.before);
  bool any = false;
  for (std::size_t i = 0; i < spans_.size(); ++i) {
    ChunkSpan& span = spans_[i];
    if (!span.indexed || span.new_connections) learn(i);
    if (!span.indexed) continue;
    begin_ = any ? std::min(begin_, span.first) : span.first;
    end_ = any ? std::max(end_, span.last) : span.last;
    any = true;
  }
  connections_.merge(found.after);
  select([](const Channel&) { return true; });
}

void ChunkedReader::learn(std::size_t i) {
  ChunkSpan& span = spans_[i];
  const auto chunk = open(i);
  const auto learn_channel = [&](const Channel& channel) {
    if (connections_.size() < most_connections) connections_.try_emplace(channel.id, channel);
  };
  std::map<std::uint32_t, TimesSummary> times;
  TimesSummary all;
  while (const auto entry = chunk->scan(learn_channel)) {
    all.add(entry->time);
    if (times_.size() + times.size() < most_connections || times.contains(entry->connection)) times[entry->connection].add(entry->time);
  }
  note(chunk->damage());
  if (span.indexed) return;
  for (const auto& [connection, summary] : times) times_[connection].append(summary);
  span.first = all.first;
  span.last = all.last;
  span.indexed = all.count > 0;
}

void ChunkedReader::select(const std::function<bool(const Channel&)>& wanted, Time from, Time until) {
  selected_.clear();
  for (const auto& [id, connection] : connections_) {
    if (wanted(connection)) selected_.emplace(id, &connection);
  }
  from_ = from;
  until_ = until;
  order_.clear();
  selected_bytes_ = opened_bytes_ = 0;
  for (std::size_t i = 0; i < spans_.size(); ++i) {
    const ChunkSpan& span = spans_[i];
    if (span.last < from || span.first >= until) continue;
    order_.push_back(i);
    selected_bytes_ += span.size;
  }
  std::ranges::stable_sort(order_, {}, [&](std::size_t i) { return spans_[i].first; });
  next_chunk_ = 0;
  open_.clear();
  last_ = Time::min();
  late_ = 0;
}

void ChunkedReader::note(const std::optional<Damage>& damage) {
  if (!damage || damages_.size() >= most_damages) return;
  const auto place = std::ranges::lower_bound(damages_, damage->offset, {}, &Damage::offset);
  if (place == damages_.end() || place->offset != damage->offset) damages_.insert(place, *damage);
}

void ChunkedReader::fill(Cursor& cursor) {
  cursor.entries.clear();
  cursor.at = 0;
  while (cursor.entries.size() < most_entries) {
    const auto entry = cursor.chunk->scan();
    if (!entry) break;
    if (entry->time >= from_ && entry->time < until_ && selected_.contains(entry->connection)) cursor.entries.push_back(*entry);
  }
  note(cursor.chunk->damage());
  if (!std::ranges::is_sorted(cursor.entries, {}, &MessageEntry::time)) std::ranges::stable_sort(cursor.entries, {}, &MessageEntry::time);
}

/// Opens every chunk that may hold a message earlier than the earliest one at hand.
void ChunkedReader::open_due_chunks() {
  const auto earlier = [](const auto& a, const auto& b) { return a->head().time < b->head().time; };
  while (next_chunk_ < order_.size()) {
    const ChunkSpan& span = spans_[order_[next_chunk_]];
    if (!open_.empty()) {
      const auto first = std::ranges::min_element(open_, earlier);
      if ((*first)->head().time < span.first) return;
      std::size_t held = span.memory;
      for (const auto& cursor : open_) held += cursor->held();
      if (open_.size() >= most_open_chunks || held > most_open_bytes) return;
    }
    opened_bytes_ += span.size;
    auto cursor = std::make_unique<Cursor>(Cursor{open(order_[next_chunk_++]), {}, 0});
    fill(*cursor);
    if (!cursor->entries.empty()) open_.push_back(std::move(cursor));
  }
}

std::optional<RawMessage> ChunkedReader::take(Cursor& cursor) {
  const MessageEntry entry = cursor.entries[cursor.at++];
  if (entry.time < last_) ++late_;
  last_ = std::max(last_, entry.time);
  RawMessage message{selected_.at(entry.connection), entry.time, {}, entry.size};
  if (entry.size > most_message_bytes) return message;
  const auto bytes = cursor.chunk->message(entry);
  note(cursor.chunk->damage());
  if (!bytes) return std::nullopt;
  message.bytes = *bytes;
  message.size = bytes->size();
  return message;
}

std::optional<RawMessage> ChunkedReader::next() {
  while (true) {
    // A chunk is left, or read further, when the message before was its last: its bytes had to stay until now.
    for (auto& cursor : open_) {
      if (cursor->at == cursor->entries.size()) fill(*cursor);
    }
    std::erase_if(open_, [](const auto& cursor) { return cursor->entries.empty(); });
    open_due_chunks();
    if (open_.empty()) return std::nullopt;
    const auto earlier = [](const auto& a, const auto& b) { return a->head().time < b->head().time; };
    if (const auto message = take(**std::ranges::min_element(open_, earlier))) return message;
  }
}

}  // namespace kilvo::lab
