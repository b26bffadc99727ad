#include "lab/recordings/recording_writer.hpp"

#include <utility>

namespace kilvo::lab {

RecordingWriter::RecordingWriter(const std::filesystem::path& path, Topics topics, Rosbag1Writer::Compression compression,
                                 std::size_t chunk_bytes)
    : bag_(path, compression, chunk_bytes), topics_(std::move(topics)) {}

void RecordingWriter::write(const Measurement& measurement, std::optional<Time> recorded) {
  const Sensor sensor = sensor_of(measurement);
  const auto i = static_cast<std::size_t>(sensor);
  if (!connections_[i]) connections_[i] = bag_.add_connection(topics_[i], written_type(sensor));
  bag_.write(*connections_[i], recorded.value_or(stamp_of(measurement)), encode(measurement, name_of(sensor)));
}

}  // namespace kilvo::lab
