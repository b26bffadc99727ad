#include "lab/recordings/mcap_reader.hpp"

namespace kilvo::lab {

McapReader::McapReader(FileBytes bytes) : ChunkedReader(std::move(bytes)) {
  McapLayout layout = read_mcap_layout(file());
  chunks_ = std::move(layout.chunks);
  Found found;
  std::set<std::uint16_t> defined;
  for (const McapChunk& chunk : chunks_) {
    const std::uint64_t memory = chunk.is_chunk ? chunk.inflated_size : chunk.data_size;
    ChunkSpan span{chunk.first, chunk.last, chunk.data_size, memory, chunk.indexed, false};
    for (const std::uint16_t channel : chunk.channels) {
      if (!layout.channels.has(channel)) span.new_connections |= defined.insert(channel).second;
    }
    found.spans.push_back(span);
  }
  found.times = std::move(layout.times);
  found.damages = std::move(layout.damages);
  found.before = layout.channels.all();
  found.after = layout.doubtful.all();
  found.after.merge(layout.doubtful.all(false));
  found.after.merge(layout.channels.all(false));
  channels_ = std::make_unique<McapChannels>(std::move(layout.channels));
  channels_->add_schemas(layout.doubtful);
  start(std::move(found));
}

StorageSummary McapReader::storage() const {
  std::set<std::string> names;
  StorageSummary summary{"MCAP", {}, 0};
  for (const McapChunk& chunk : chunks_) {
    names.insert(chunk.compression);
    summary.chunks += chunk.is_chunk ? 1 : 0;
  }
  for (const auto& name : names) summary.compression += (summary.compression.empty() ? "" : " ") + name;
  return summary;
}

std::unique_ptr<ChunkReader> McapReader::open(std::size_t span) {
  return std::make_unique<McapChunkReader>(file(), chunks_[span], *channels_);
}

}  // namespace kilvo::lab
