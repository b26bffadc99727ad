// Messages of the kinds that KILVO publishes, as a log in MCAP that Foxglove opens.
#pragma once

#include <map>
#include <mutex>
#include <string_view>

#include "lab/recordings/mcap_writer.hpp"

namespace kilvo::lab {

/// May be used by several threads.
class MessageLog {
 public:
  /// Throws OutputError, as do write() and close().
  explicit MessageLog(const std::filesystem::path& path) : file_(path, McapWriter::Compression::zstd, "ros2") {}

  /// A message in CDR. A topic begins with its first message; `definition`, as ROS 1 or ROS 2 has it, where the type is not one that KILVO
  /// knows (known_definition()).
  void write(const std::string& topic, std::string_view type, Time t, Bytes cdr, std::string_view definition = {});
  void close();

 private:
  std::mutex mutex_;
  McapWriter file_;
  std::map<std::string, std::uint32_t> channels_;  // by topic
};

}  // namespace kilvo::lab
