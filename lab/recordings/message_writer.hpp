// What every recording that is written is, whatever its format.
#pragma once

#include "lab/mapping/output_error.hpp"
#include "lab/recordings/recording_reader.hpp"

namespace kilvo::lab {

class MessageWriter {
 public:
  virtual ~MessageWriter() = default;

  /// The id to write messages of this topic with; the channel's own id does not matter. Its encoding must be one that the format holds.
  virtual std::uint32_t add_channel(const Channel& channel) = 0;
  /// `recorded`: when the message arrived; best given in ascending order. Throws OutputError when the disk is full, as do flush and close.
  virtual void write(std::uint32_t channel, Time recorded, Bytes message) = 0;
  /// What was written so far can be read, even if the recording is never closed.
  virtual void flush() = 0;
  virtual void close() = 0;
};

}  // namespace kilvo::lab
