// Measurements -> a recording: what any MeasurementSource gives can be kept and played again.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "kilvo/sensors/measurement.hpp"
#include "lab/recordings/rosbag1_writer.hpp"

namespace kilvo::lab {

class RecordingWriter {
 public:
  /// One topic per sensor, in the order of Sensor; only those of which there are measurements appear in the recording.
  using Topics = std::array<std::string, sensor_count>;

  /// Throws OutputError, as do all functions.
  RecordingWriter(const std::filesystem::path& path, Topics topics,
                  Rosbag1Writer::Compression compression = Rosbag1Writer::Compression::none, std::size_t chunk_bytes = default_chunk_bytes);

  /// `recorded`: when the measurement arrived; by default at its own stamp.
  void write(const Measurement& measurement, std::optional<Time> recorded = std::nullopt);

  void close() { bag_.close(); }

  /// For topics beyond the four sensors (ground truth).
  Rosbag1Writer& bag() { return bag_; }

 private:
  Rosbag1Writer bag_;
  Topics topics_;
  std::array<std::optional<std::uint32_t>, sensor_count> connections_;
};

}  // namespace kilvo::lab
