// Reads ROS 1 bags of version 2.0: chunks uncompressed, bz2 or lz4; closed properly, or cut short, or damaged.
#pragma once

#include <functional>
#include <memory>

#include "lab/recordings/rosbag1_chunk.hpp"

namespace kilvo::lab {

struct RawMessage {
  const BagConnection* connection = nullptr;
  Time time{};           // when it was recorded
  Bytes bytes;           // valid until the next call of next()
  std::size_t size = 0;  // larger than `bytes` when the message is too large to be read (most_message_bytes)
};

inline constexpr std::size_t most_message_bytes = std::size_t{64} << 20;

/// Delivers messages by the time of their recording: over all of the file, as far as 64 chunks (or 64 MB of inflated ones) overlap.
/// Memory is bounded by these, whatever the bag holds. Never throws after construction; damage is noted and skipped.
class Rosbag1Reader {
 public:
  /// Throws InputError when the file cannot be read or is no such bag.
  explicit Rosbag1Reader(const std::filesystem::path& path) : Rosbag1Reader(FileBytes(path)) {}
  explicit Rosbag1Reader(FileBytes file);
  ~Rosbag1Reader();
  Rosbag1Reader(Rosbag1Reader&&) noexcept;

  const std::string& name() const { return file_->name(); }
  std::uint64_t file_size() const { return file_->size(); }

  /// By connection id. A topic may have several.
  const std::map<std::uint32_t, BagConnection>& connections() const { return connections_; }

  /// What the index says (or the chunks themselves, where they have none), by connection id.
  const std::map<std::uint32_t, TimesSummary>& times() const { return layout_.times; }

  /// Times of the first and the last message of the file; both 0 when it has none.
  Time begin() const { return begin_; }
  Time end() const { return end_; }
  const std::vector<BagChunk>& chunks() const { return layout_.chunks; }

  /// Starts again at the beginning: messages of the connections that `wanted` approves, recorded in [from, until). The rest is not even
  /// read.
  void select(const std::function<bool(const BagConnection&)>& wanted, Time from = Time::min(), Time until = Time::max());

  /// Nothing at the end. Without select(): every message.
  std::optional<RawMessage> next();

  /// What was found damaged so far, in the order of the file.
  const std::vector<Damage>& damages() const { return layout_.damages; }
  std::optional<Damage> damage() const { return damages().empty() ? std::nullopt : std::optional(damages().front()); }

  /// Messages that came out later than a message recorded after them: 0 unless chunks overlap too deeply.
  std::uint64_t late_messages() const { return late_; }

  /// Fraction of what was selected, 0 to 1.
  double progress() const { return selected_bytes_ == 0 ? 1 : static_cast<double>(opened_bytes_) / static_cast<double>(selected_bytes_); }

 private:
  struct Cursor;

  void learn_connections();
  void open_due_chunks();
  void fill(Cursor& cursor);
  void note(const std::optional<Damage>& damage);

  std::unique_ptr<FileBytes> file_;  // chunk readers point to it
  BagLayout layout_;
  std::map<std::uint32_t, BagConnection> connections_;
  Time begin_{}, end_{};

  std::map<std::uint32_t, const BagConnection*> selected_;
  Time from_ = Time::min(), until_ = Time::max();
  std::vector<std::size_t> order_;  // chunks to read, by their first message
  std::size_t next_chunk_ = 0;
  std::uint64_t selected_bytes_ = 0, opened_bytes_ = 0;
  std::vector<std::unique_ptr<Cursor>> open_;
  Time last_ = Time::min();
  std::uint64_t late_ = 0;
};

}  // namespace kilvo::lab
