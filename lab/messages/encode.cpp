#include "lab/messages/encode.hpp"

#include "lab/messages/byte_writer.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t point_step = 24;  // four floats and a double

void put_header(ByteWriter& writer, Time stamp, const std::string& frame_id) {
  writer.put(std::uint32_t{0}).put_time(stamp).put_string(frame_id);
}

void put_doubles(ByteWriter& writer, const std::vector<double>& values) {
  writer.put(static_cast<std::uint32_t>(values.size())).append(values.data(), values.size() * sizeof(double));
}

void put_vector3(ByteWriter& writer, const Eigen::Vector3d& v) { writer.put(v.x()).put(v.y()).put(v.z()); }

void put_covariance(ByteWriter& writer, double first) {
  writer.put(first);
  for (int i = 1; i < 9; ++i) writer.put(0.0);
}

void put_field(ByteWriter& writer, std::string_view name, std::uint32_t offset, std::uint8_t datatype) {
  writer.put_string(name).put(offset).put(datatype).put(std::uint32_t{1});
}

}  // namespace

std::vector<std::uint8_t> encode(const ImuSample& sample, const std::string& frame_id) {
  ByteWriter writer;
  put_header(writer, sample.t, frame_id);
  writer.put(0.0).put(0.0).put(0.0).put(1.0);
  put_covariance(writer, -1);
  put_vector3(writer, sample.gyro);
  put_covariance(writer, 0);
  put_vector3(writer, sample.accel);
  put_covariance(writer, 0);
  return writer.take();
}

std::vector<std::uint8_t> encode(const JointSample& sample, const std::string& frame_id) {
  ByteWriter writer;
  put_header(writer, sample.t, frame_id);
  writer.put(static_cast<std::uint32_t>(sample.names.size()));
  for (const auto& name : sample.names) writer.put_string(name);
  put_doubles(writer, sample.position);
  put_doubles(writer, sample.velocity);
  put_doubles(writer, sample.effort);
  return writer.take();
}

std::vector<std::uint8_t> encode(const LidarScan& scan, const std::string& frame_id) {
  constexpr std::uint8_t float32 = 7, float64 = 8;
  const auto count = static_cast<std::uint32_t>(scan.points.size());
  const auto data_size = static_cast<std::uint32_t>(count * point_step);
  ByteWriter writer;
  writer.reserve(data_size + 256);
  put_header(writer, scan.t, frame_id);
  writer.put(std::uint32_t{1}).put(count).put(std::uint32_t{5});
  put_field(writer, "x", 0, float32);
  put_field(writer, "y", 4, float32);
  put_field(writer, "z", 8, float32);
  put_field(writer, "intensity", 12, float32);
  put_field(writer, "timestamp", 16, float64);
  writer.put(std::uint8_t{0}).put(static_cast<std::uint32_t>(point_step)).put(data_size).put(data_size);
  for (const auto& p : scan.points) {
    writer.put(p.x).put(p.y).put(p.z).put(p.intensity).put(static_cast<double>(to_ns(scan.t) + p.offset_ns));
  }
  writer.put(std::uint8_t{1});
  return writer.take();
}

std::vector<std::uint8_t> encode(const CameraImage& image, const std::string& frame_id) {
  ByteWriter writer;
  writer.reserve(image.image.pixels.size() + 128);
  put_header(writer, image.t, frame_id);
  writer.put(static_cast<std::uint32_t>(image.image.height)).put(static_cast<std::uint32_t>(image.image.width));
  writer.put_string(image.image.channels == 1 ? "mono8" : "rgb8").put(std::uint8_t{0});
  writer.put(static_cast<std::uint32_t>(image.image.width * image.image.channels));
  writer.put(static_cast<std::uint32_t>(image.image.pixels.size())).append(image.image.pixels.data(), image.image.pixels.size());
  return writer.take();
}

std::vector<std::uint8_t> encode(const Measurement& measurement, const std::string& frame_id) {
  return std::visit([&](const auto& m) { return encode(m, frame_id); }, measurement);
}

}  // namespace kilvo::lab
