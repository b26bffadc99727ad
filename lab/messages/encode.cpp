#include "lab/messages/encode.hpp"

#include "lab/messages/ros_types.hpp"
#include "lab/messages/wire_writer.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t point_step = 24;  // four floats and a double

Vector3Message message_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

template <class T>
void put(std::uint8_t*& at, T value) {
  std::memcpy(at, &value, sizeof value);
  at += sizeof value;
}

}  // namespace

std::vector<std::uint8_t> encode(const ImuSample& sample, const std::string& frame_id, Encoding encoding) {
  ImuMessage m{{{}, sample.t, frame_id}, {}, {}, message_of(sample.gyro), {}, message_of(sample.accel), {}};
  m.orientation_covariance[0] = -1;
  return write_message(m, encoding);
}

std::vector<std::uint8_t> encode(const JointSample& sample, const std::string& frame_id, Encoding encoding) {
  const JointStateMessage m{{{}, sample.t, frame_id},
                            {sample.names.begin(), sample.names.end()},
                            Numbers<double>::of(sample.position),
                            Numbers<double>::of(sample.velocity),
                            Numbers<double>::of(sample.effort)};
  return write_message(m, encoding);
}

std::vector<std::uint8_t> encode(const LidarScan& scan, const std::string& frame_id, Encoding encoding) {
  constexpr std::uint8_t float32 = 7, float64 = 8;
  std::vector<std::uint8_t> data(scan.points.size() * point_step);
  std::uint8_t* at = data.data();
  for (const auto& p : scan.points) {
    for (const float value : {p.x, p.y, p.z, p.intensity}) put(at, value);
    put(at, static_cast<double>(to_ns(scan.t) + p.offset_ns));
  }
  PointCloud2Message m;
  m.header = {{}, scan.t, frame_id};
  m.width = static_cast<std::uint32_t>(scan.points.size());
  m.point_fields = {{"x", 0, float32}, {"y", 4, float32}, {"z", 8, float32}, {"intensity", 12, float32}, {"timestamp", 16, float64}};
  m.point_step = static_cast<std::uint32_t>(point_step);
  m.row_step = static_cast<std::uint32_t>(data.size());
  m.data = Numbers<std::uint8_t>::of(data);
  return write_message(m, encoding);
}

std::vector<std::uint8_t> encode(const CameraImage& image, const std::string& frame_id, Encoding encoding) {
  ImageMessage m;
  m.header = {{}, image.t, frame_id};
  m.height = static_cast<std::uint32_t>(image.image.height);
  m.width = static_cast<std::uint32_t>(image.image.width);
  m.encoding = image.image.channels == 1 ? "mono8" : "rgb8";
  m.step = static_cast<std::uint32_t>(image.image.width * image.image.channels);
  m.data = Numbers<std::uint8_t>::of(image.image.pixels);
  return write_message(m, encoding);
}

std::vector<std::uint8_t> encode(const Measurement& measurement, const std::string& frame_id, Encoding encoding) {
  return std::visit([&](const auto& m) { return encode(m, frame_id, encoding); }, measurement);
}

}  // namespace kilvo::lab
