// The messages in one chunk of an MCAP file, or in a run of records outside of chunks.
#pragma once

#include "lab/recordings/mcap_layout.hpp"

namespace kilvo::lab {

/// Holds all of the chunk in memory. Of a chunk whose checksum is wrong nothing is given, since nobody knows what of it is; of one that the
/// end of the file has cut, what is there.
class McapChunkReader final : public ChunkReader {
 public:
  /// `channels`: what is known of channels and schemas so far; those on the way are added.
  McapChunkReader(const FileBytes& file, const McapChunk& chunk, McapChannels& channels);

  std::optional<MessageEntry> scan(const std::function<void(const Channel&)>& on_connection = {}) override;
  std::optional<Bytes> message(const MessageEntry& entry) override;
  const std::optional<Damage>& damage() const override { return damage_; }
  std::size_t held() const override { return bytes_.capacity() + message_.capacity(); }

 private:
  void load(const FileBytes& file, const McapChunk& chunk);
  void note(std::uint64_t offset, const std::string& reason);
  void define(Bytes record, McapOp op, const std::function<void(const Channel&)>& on_connection);

  McapChannels& channels_;
  std::uint64_t offset_;  // for damages: of the chunk, or of an uncompressed record in it
  bool direct_;           // the records are in the file as they are
  bool doubtful_end_;
  std::vector<std::uint8_t> bytes_;
  std::size_t good_ = 0;  // of them: beyond, a damaged chunk was inflated to who knows what
  std::size_t position_ = 0;
  std::vector<std::uint8_t> message_;  // one that was compressed by itself
  std::optional<Damage> damage_;
};

}  // namespace kilvo::lab
