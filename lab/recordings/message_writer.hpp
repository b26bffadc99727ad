// What every recording that is written is, whatever its format.
#pragma once

#include <stdexcept>

#include "lab/recordings/recording_reader.hpp"

namespace kilvo::lab {

/// A file that cannot be created or written. The command line ends with exit code 2.
struct OutputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

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
