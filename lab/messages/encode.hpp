// Measurement -> message bytes: for recordings that KILVO writes (the simulator's, the tests').
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "kilvo/sensors/measurement.hpp"
#include "lab/messages/encoding.hpp"

namespace kilvo::lab {

/// What a recording says of a topic, so that any ROS 1 tool can read it.
struct MessageType {
  std::string_view name;        // "sensor_msgs/Imu"
  std::string_view md5sum;      // over the definition, as ROS has it
  std::string_view definition;  // with the definitions of the types within
};

/// The type that encode() writes for a sensor: Imu, JointState, PointCloud2, Image.
const MessageType& written_type(Sensor sensor);

/// Unit quaternion of no meaning and covariances of zero; orientation_covariance[0] = -1 says "no orientation".
std::vector<std::uint8_t> encode(const ImuSample& sample, const std::string& frame_id, Encoding encoding = Encoding::ros1);

std::vector<std::uint8_t> encode(const JointSample& sample, const std::string& frame_id, Encoding encoding = Encoding::ros1);

/// Fields x y z intensity (float32) and timestamp (float64, absolute nanoseconds, as livox_ros_driver2; a double holds such a time to
/// 256 ns). Height 1, no padding.
std::vector<std::uint8_t> encode(const LidarScan& scan, const std::string& frame_id, Encoding encoding = Encoding::ros1);

/// mono8 or rgb8.
std::vector<std::uint8_t> encode(const CameraImage& image, const std::string& frame_id, Encoding encoding = Encoding::ros1);

std::vector<std::uint8_t> encode(const Measurement& measurement, const std::string& frame_id, Encoding encoding = Encoding::ros1);

}  // namespace kilvo::lab
