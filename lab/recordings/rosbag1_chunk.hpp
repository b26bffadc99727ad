// The messages in one chunk of a ROS 1 bag.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "lab/recordings/rosbag1_layout.hpp"

namespace kilvo::lab {

/// Reads an uncompressed chunk piece by piece from the file, skipping what is not asked for; inflates any other chunk as a whole.
class BagChunkReader final : public ChunkReader {
 public:
  BagChunkReader(const FileBytes& file, const BagChunk& chunk);

  std::optional<MessageEntry> scan(const std::function<void(const Channel&)>& on_connection = {}) override;
  std::optional<Bytes> message(const MessageEntry& entry) override;
  const std::optional<Damage>& damage() const override { return damage_; }
  std::size_t held() const override { return inflated_.capacity() + window_.capacity() + large_.capacity(); }

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
