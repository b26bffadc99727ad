// Reads the SQLite files of rosbag2 (.db3), of any version of its tables, messages as they are or each compressed with zstd.
#pragma once

#include "lab/recordings/chunked_reader.hpp"
#include "lab/recordings/sqlite_file.hpp"

namespace kilvo::lab {

class Db3Reader final : public ChunkedReader {
 public:
  /// Throws InputError when the file cannot be read or has no tables `topics` and `messages`.
  explicit Db3Reader(const std::filesystem::path& path) : Db3Reader(FileBytes(path)) {}
  explicit Db3Reader(FileBytes bytes);
  ~Db3Reader() override;

  StorageSummary storage() const override;

 private:
  /// Rows that follow each other.
  struct Block {
    std::int64_t first = 0, last = 0;  // row ids
    TimesSummary times;
    std::uint64_t bytes = 0;
  };

  std::unique_ptr<ChunkReader> open(std::size_t span) override;
  std::map<std::uint32_t, Channel> read_topics();
  void read_rows(Found& found);
  void judge_end(Found& found) const;

  std::unique_ptr<SqliteFile> database_;
  std::vector<Block> blocks_;
  std::map<std::uint32_t, Channel> topics_;
  bool message_compression_ = false;
};

}  // namespace kilvo::lab
