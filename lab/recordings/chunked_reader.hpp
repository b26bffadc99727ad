// A recording in one file that consists of chunks, of which the time of the first and last message are known: the part that the formats
// have in common.
#pragma once

#include <memory>

#include "lab/recordings/file_bytes.hpp"
#include "lab/recordings/recording_reader.hpp"

namespace kilvo::lab {

/// Where a message is within its chunk.
struct MessageEntry {
  Time time{};
  std::uint64_t offset = 0;  // of the message's bytes in the chunk, or what else finds them again
  std::uint32_t size = 0;
  std::uint32_t connection = 0;
};

/// The messages in one chunk.
class ChunkReader {
 public:
  virtual ~ChunkReader() = default;

  /// The next message in the order of the file, or nothing at the end of the chunk or of what can be read of it. Channels that are
  /// defined on the way go to `on_connection`, if there is one: also those in data of which the messages are too doubtful to be given.
  virtual std::optional<MessageEntry> scan(const std::function<void(const Channel&)>& on_connection = {}) = 0;
  /// The bytes of a message, valid until the next call of any function; nothing when they are damaged.
  virtual std::optional<Bytes> message(const MessageEntry& entry) = 0;
  /// What is wrong with the chunk, as far as it was read.
  virtual const std::optional<Damage>& damage() const = 0;
  /// Memory held, bytes.
  virtual std::size_t held() const = 0;
};

struct ChunkSpan {
  Time first{}, last{};          // when its messages were recorded
  std::uint64_t size = 0;        // bytes in the file
  std::uint64_t memory = 0;      // bytes that opening it needs
  bool indexed = false;          // first and last are known; else the chunk is read for them
  bool new_connections = false;  // it may define channels that nothing else does
};

/// Messages are delivered in the order of time over all of the file, as far as 64 chunks (or 64 MB of inflated ones) overlap.
class ChunkedReader : public RecordingReader {
 public:
  ~ChunkedReader() override;
  ChunkedReader(ChunkedReader&&) noexcept;

  const std::string& name() const override { return file_->name(); }
  std::uint64_t file_size() const override { return file_->size(); }
  const std::map<std::uint32_t, Channel>& connections() const override { return connections_; }
  const std::map<std::uint32_t, TimesSummary>& times() const override { return times_; }
  Time begin() const override { return begin_; }
  Time end() const override { return end_; }
  void select(const std::function<bool(const Channel&)>& wanted, Time from = Time::min(), Time until = Time::max()) override;
  std::optional<RawMessage> next() override;
  const std::vector<Damage>& damages() const override { return damages_; }
  std::uint64_t late_messages() const override { return late_; }
  double progress() const override {
    return selected_bytes_ == 0 ? 1 : static_cast<double>(opened_bytes_) / static_cast<double>(selected_bytes_);
  }

 protected:
  explicit ChunkedReader(FileBytes file);

  /// What the layout of the file says. Chunks that are not indexed, or may define channels, are read through; of the channels that the
  /// layout knows those that a chunk defines too are the chunk's, as in `first_wins`. To be called once, at the end of the constructor.
  struct Found {
    std::vector<ChunkSpan> spans;
    std::map<std::uint32_t, TimesSummary> times;     // over the indexed chunks
    std::vector<Damage> damages;                     // in the order of the file
    std::map<std::uint32_t, Channel> before, after;  // channels that count before those in chunks, and where no chunk defines them
  };
  void start(Found found);

  virtual std::unique_ptr<ChunkReader> open(std::size_t span) = 0;

  const FileBytes& file() const { return *file_; }
  void note(const std::optional<Damage>& damage);

 private:
  struct Cursor;

  void learn(std::size_t span);
  void open_due_chunks();
  void fill(Cursor& cursor);
  std::optional<RawMessage> take(Cursor& cursor);

  std::unique_ptr<FileBytes> file_;  // chunk readers point to it
  std::vector<ChunkSpan> spans_;     // in the order of the file
  std::map<std::uint32_t, Channel> connections_;
  std::map<std::uint32_t, TimesSummary> times_;
  std::vector<Damage> damages_;
  Time begin_{}, end_{};

  std::map<std::uint32_t, const Channel*> selected_;
  Time from_ = Time::min(), until_ = Time::max();
  std::vector<std::size_t> order_;  // chunks to read, by their first message
  std::size_t next_chunk_ = 0;
  std::uint64_t selected_bytes_ = 0, opened_bytes_ = 0;
  std::vector<std::unique_ptr<Cursor>> open_;
  Time last_ = Time::min();
  std::uint64_t late_ = 0;
};

}  // namespace kilvo::lab
