// For tests: small recordings in a folder of their own.
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <unistd.h>
#include <vector>

#include "kilvo/sensors/measurement.hpp"
#include "lab/recordings/recording_writer.hpp"
#include "lab/recordings/rosbag1_reader.hpp"

namespace kilvo::lab {

/// Is gone with all that is in it at the end of the test.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "kilvo-XXXXXX").string();
    if (::mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

inline const RecordingWriter::Topics tiny_topics{"/imu", "/joints", "/points", "/camera/image_raw"};
inline constexpr Time tiny_begin = time_from_ns(1'700'000'000'000'000'000);

/// IMU at 100 Hz, joints at 200 Hz, clouds of 120 points at 10 Hz, grey images of 16x8 at 10 Hz, in the order of time.
inline std::vector<Measurement> tiny_walk(int milliseconds = 500) {
  std::vector<Measurement> all;
  for (int ms = 0; ms < milliseconds; ms += 5) {
    const Time t = tiny_begin + std::chrono::milliseconds(ms);
    const double x = 0.001 * ms;
    all.emplace_back(JointSample{t, {"left_knee_joint", "right_knee_joint"}, {x, -x}, {1, -1}, {}});
    if (ms % 10 == 0) all.emplace_back(ImuSample{t, {x, 0, -x}, {0, 0, 9.81}});
    if (ms % 100 == 0) {
      LidarScan scan{t, {}};
      for (int i = 0; i < 120; ++i) scan.points.push_back({1, static_cast<float>(i), 2, static_cast<float>(ms), i * 500'224});
      all.emplace_back(std::move(scan));
      all.emplace_back(CameraImage{t, {16, 8, 1, std::vector<std::uint8_t>(128, static_cast<std::uint8_t>(ms / 10))}});
    }
  }
  return all;
}

/// With chunks of some kB, so that there are many.
inline void write_bag(const std::filesystem::path& path, const std::vector<Measurement>& measurements, std::size_t chunk_bytes = 4096,
                      Rosbag1Writer::Compression compression = Rosbag1Writer::Compression::none) {
  RecordingWriter writer(path, tiny_topics, compression, chunk_bytes);
  for (const auto& measurement : measurements) writer.write(measurement);
  writer.close();
}

/// A message that was read.
struct KeptMessage {
  std::uint32_t connection = 0;
  Time time{};
  std::vector<std::uint8_t> bytes;

  bool operator<(const KeptMessage& other) const {
    return std::tie(connection, time, bytes) < std::tie(other.connection, other.time, other.bytes);
  }
};

inline std::vector<KeptMessage> read_all(RecordingReader& reader) {
  std::vector<KeptMessage> all;
  while (const auto m = reader.next()) all.push_back({m->connection->id, m->time, {m->bytes.begin(), m->bytes.end()}});
  return all;
}

inline std::vector<KeptMessage> read_all(const std::filesystem::path& path) {
  Rosbag1Reader reader(path);
  return read_all(reader);
}

inline std::vector<std::uint8_t> file_content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline void set_file_content(const std::filesystem::path& path, Bytes content) {
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(content.data()), static_cast<std::streamsize>(content.size()));
}

}  // namespace kilvo::lab
