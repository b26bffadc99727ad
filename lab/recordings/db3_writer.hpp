// Writes the SQLite files of rosbag2 (.db3), tables as of version 4.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "lab/recordings/message_writer.hpp"

namespace kilvo::lab {

class Db3Writer final : public MessageWriter {
 public:
  /// `compress`: each message is a zstd frame. An existing file is replaced. Throws OutputError.
  Db3Writer(const std::filesystem::path& path, bool compress);
  ~Db3Writer() override;

  std::uint32_t add_channel(const Channel& channel) override;
  void write(std::uint32_t channel, Time recorded, Bytes message) override;
  void flush() override;
  void close() override;

 private:
  struct Database;

  std::unique_ptr<Database> database_;
  std::string name_;
  bool compress_;
  std::uint32_t topics_ = 0;
  std::vector<std::string> defined_;  // types
};

}  // namespace kilvo::lab
