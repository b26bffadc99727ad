// The messages in one chunk of a ROS 1 bag.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "lab/recordings/rosbag1_layout.hpp"

namespace kilvo::lab {

/// Where a message is within its chunk.
struct BagEntry {
  Time time{};
  std::uint64_t offset = 0;  // of the message's bytes in the inflated chunk
  std::uint32_t size = 0;
  std::uint32_t connection = 0;
};

/// Reads an uncompressed chunk piece by piece from the file, skipping what is not asked for; inflates any other chunk as a whole.
class BagChunkReader {
 public:
  BagChunkReader(const FileBytes& file, const BagChunk& chunk);

  /// The next message in the order of the file, or nothing at the end of the chunk or of what can be read of it. Connection records
  /// on the way go to `on_connection`, if there is one: also those in data of which the messages are too doubtful to be given.
  std::optional<BagEntry> scan(const std::function<void(const BagConnection&)>& on_connection = {});

  /// The bytes of a message, valid until the next call of any function. Empty when the file can no longer be read.
  Bytes message(const BagEntry& entry);

  /// What is wrong with the chunk, as far as it was scanned.
  const std::optional<Damage>& damage() const { return damage_; }

  /// Memory held, bytes.
  std::size_t held() const { return inflated_.capacity() + window_.capacity() + large_.capacity(); }

 private:
  Bytes view(std::uint64_t offset, std::uint64_t count);
  void note(std::uint64_t offset, const std::string& reason);

  const FileBytes* file_;
  BagChunk chunk_;
  std::vector<std::uint8_t> inflated_;
  std::uint64_t size_ = 0;  // of the content
  std::uint64_t good_ = 0;  // of it: beyond, a damaged chunk was inflated to who knows what
  FileWindow window_;
  std::vector<std::uint8_t> large_;  // a message that does not fit the window
  std::uint64_t position_ = 0;
  std::optional<Damage> damage_;
};

}  // namespace kilvo::lab
