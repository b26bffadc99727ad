// Writes a folder of rosbag2: files of MCAP or SQLite, a new one from time to time, and metadata.yaml.
#pragma once

#include <functional>

#include "lab/recordings/output_recording.hpp"

namespace kilvo::lab {

class Rosbag2Writer final : public MessageWriter {
 public:
  using Create = std::function<std::unique_ptr<MessageWriter>(const std::filesystem::path&)>;

  /// The folder must be new or empty. Throws OutputError.
  Rosbag2Writer(const std::filesystem::path& folder, OutputFormat format, Create create);
  ~Rosbag2Writer() override;

  std::uint32_t add_channel(const Channel& channel) override;
  void write(std::uint32_t channel, Time recorded, Bytes message) override;
  void flush() override;
  void close() override;

 private:
  struct File {
    std::string name;
    TimesSummary times;
  };
  struct Topic {
    Channel channel;
    std::uint64_t count = 0;
    std::optional<std::uint32_t> id;  // in the file that is being written
  };

  void begin_file();
  void write_metadata() const;

  std::filesystem::path folder_;
  OutputFormat format_;
  Create create_;
  std::vector<Topic> topics_;
  std::vector<File> files_;
  std::unique_ptr<MessageWriter> writer_;
  bool closed_ = false;
};

}  // namespace kilvo::lab
