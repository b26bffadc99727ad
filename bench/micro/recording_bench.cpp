// Reading 100 MB of messages from each format: clouds of 500 kB at 10 Hz, beside them samples of 650 bytes at 1 kHz. 333 000 microseconds
// are 300 MB/s.
#include <benchmark/benchmark.h>
#include <filesystem>
#include <random>
#include <unistd.h>
#include <vector>

#include "lab/recordings/output_recording.hpp"
#include "lab/recordings/recording_file.hpp"

namespace kilvo::lab {
namespace {

namespace fs = std::filesystem;
using Storage = OutputFormat::Storage;
using Compression = OutputFormat::Compression;

constexpr std::size_t cloud_bytes = 500'000, sample_bytes = 650, wanted_bytes = 100'000'000;
constexpr int samples_per_cloud = 100;

// Coordinates in single precision: their low bits are noise, as those of a LiDAR are.
std::vector<std::uint8_t> noisy(std::size_t bytes) {
  std::mt19937 random(1);
  std::normal_distribution<float> metres(5, 2);
  std::vector<float> values(bytes / sizeof(float) + 1);
  for (float& v : values) v = metres(random);
  const auto* begin = reinterpret_cast<const std::uint8_t*>(values.data());
  return {begin, begin + bytes};
}

/// A file that is gone with it.
class Recording {
 public:
  Recording(const std::string& ending, Compression compression)
      : path_(fs::temp_directory_path() / ("kilvo_bench_" + std::to_string(getpid()) + ending)) {
    OutputFormat format = output_format(path_);
    format.compression = compression;
    const auto writer = create_recording(path_, format);
    const auto clouds = writer->add_channel({0, "/points", "sensor_msgs/PointCloud2", {}, "*", format.encoding()});
    const auto samples = writer->add_channel({1, "/joint_states", "sensor_msgs/JointState", {}, "*", format.encoding()});
    const auto cloud = noisy(cloud_bytes), sample = noisy(sample_bytes);
    std::int64_t ms = 0;
    while (bytes_ < wanted_bytes) {
      writer->write(clouds, time_from_ns(ms * 1'000'000), cloud);
      for (int i = 0; i < samples_per_cloud; ++i) writer->write(samples, time_from_ns(++ms * 1'000'000), sample);
      bytes_ += cloud.size() + samples_per_cloud * sample.size();
    }
    writer->close();
  }
  ~Recording() { fs::remove(path_); }
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  const fs::path& path() const { return path_; }
  std::size_t bytes() const { return bytes_; }

 private:
  fs::path path_;
  std::size_t bytes_ = 0;
};

void read_100_mb(benchmark::State& state, const std::string& ending, Compression compression) {
  const Recording recording(ending, compression);
  for (auto _ : state) {
    const auto reader = open_recording(recording.path());
    std::size_t bytes = 0;
    while (const auto message = reader->next()) {
      bytes += message->bytes.size();
      benchmark::DoNotOptimize(message->bytes.back());
    }
    if (bytes != recording.bytes()) state.SkipWithError("not all of it was read");
  }
}

BENCHMARK_CAPTURE(read_100_mb, mcap, ".mcap", Compression::none)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(read_100_mb, mcap_lz4, ".mcap", Compression::lz4)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(read_100_mb, mcap_zstd, ".mcap", Compression::zstd)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(read_100_mb, bag, ".bag", Compression::none)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(read_100_mb, db3, ".db3", Compression::none)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace kilvo::lab
