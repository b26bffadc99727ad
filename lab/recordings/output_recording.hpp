// A recording to be written, of the format that its name says, or in a folder of rosbag2.
#pragma once

#include <filesystem>
#include <limits>
#include <memory>

#include "lab/recordings/message_writer.hpp"

namespace kilvo::lab {

struct OutputFormat {
  enum class Storage : std::uint8_t { bag, mcap, db3 };
  enum class Compression : std::uint8_t { none, lz4, zstd, message };

  Storage storage = Storage::bag;
  Compression compression = Compression::none;             // message: of .db3, each message by itself with zstd
  bool folder = false;                                     // of rosbag2, with metadata.yaml
  double split = std::numeric_limits<double>::infinity();  // s: a folder gets a new file so often

  /// What a bag holds is in the encoding of ROS 1; all else in CDR.
  Encoding encoding() const { return storage == Storage::bag ? Encoding::ros1 : Encoding::cdr; }
};

/// By the ending of the name: .bag, .mcap, .db3, or none: a folder of rosbag2 with MCAP in it.
OutputFormat output_format(const std::filesystem::path& path);

/// Throws OutputError when it cannot be written, or when the format does not know the compression.
std::unique_ptr<MessageWriter> create_recording(const std::filesystem::path& path, const OutputFormat& format);

}  // namespace kilvo::lab
