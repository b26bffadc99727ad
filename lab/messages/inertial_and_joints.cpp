#include "lab/messages/inertial_and_joints.hpp"

#include <string>
#include <vector>

#include "lab/messages/ros_header.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t most_joints = 10'000;  // a message of empty names must not cost many times its size

DecodeError wrong_length(const char* type, Bytes message, const ByteReader& reader) {
  if (!reader.ok()) {
    return {std::string(type) + ": a field at byte " + std::to_string(reader.position()) + " does not fit the message's " +
            std::to_string(message.size()) + " bytes"};
  }
  return {std::string(type) + ": " + std::to_string(reader.remaining()) + " bytes left over at the end"};
}

Eigen::Vector3d read_vector3(ByteReader& reader) {
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) v[i] = reader.read<double>();
  return v;
}

std::vector<double> read_doubles(ByteReader& reader) {
  const Bytes raw = reader.array(sizeof(double));
  std::vector<double> values(raw.size() / sizeof(double));
  if (!raw.empty()) std::memcpy(values.data(), raw.data(), raw.size());
  return values;
}

std::vector<std::string> read_strings(ByteReader& reader) {
  const std::size_t count = reader.read<std::uint32_t>();
  std::vector<std::string> strings;
  // Each string has at least its length, so a claimed count beyond that is known to be false before anything is allocated.
  if (count > most_joints || count > reader.remaining() / 4) {
    reader.fail();
    return strings;
  }
  strings.reserve(count);
  for (std::size_t i = 0; i < count && reader.ok(); ++i) strings.emplace_back(reader.string());
  return strings;
}

}  // namespace

Decoded<ImuSample> decode_imu(Bytes message) {
  constexpr std::size_t covariance = 9 * sizeof(double);
  ByteReader reader(message);
  ImuSample sample;
  sample.t = read_ros_header(reader).stamp;
  reader.skip(4 * sizeof(double) + covariance);  // orientation
  sample.gyro = read_vector3(reader);
  reader.skip(covariance);
  sample.accel = read_vector3(reader);
  reader.skip(covariance);
  if (!reader.ok() || reader.remaining() != 0) return wrong_length("sensor_msgs/Imu", message, reader);
  return sample;
}

Decoded<JointSample> decode_joint_state(Bytes message) {
  ByteReader reader(message);
  JointSample sample;
  sample.t = read_ros_header(reader).stamp;
  sample.names = read_strings(reader);
  sample.position = read_doubles(reader);
  sample.velocity = read_doubles(reader);
  sample.effort = read_doubles(reader);
  if (!reader.ok() || reader.remaining() != 0) return wrong_length("sensor_msgs/JointState", message, reader);
  return sample;
}

}  // namespace kilvo::lab
