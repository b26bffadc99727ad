// The ROS messages that KILVO reads or writes, field by field, in the order of their definitions.
#pragma once

#include "lab/messages/wire_fields.hpp"

namespace kilvo::lab {

struct RosHeader {
  Ros1Only<std::uint32_t> seq;
  Time stamp{};
  std::string_view frame_id;

  static void fields(auto& m, auto&& visit) { visit(m.seq, m.stamp, m.frame_id); }
};

struct Vector3Message {
  double x = 0, y = 0, z = 0;

  static void fields(auto& m, auto&& visit) { visit(m.x, m.y, m.z); }
};

struct QuaternionMessage {
  double x = 0, y = 0, z = 0, w = 1;

  static void fields(auto& m, auto&& visit) { visit(m.x, m.y, m.z, m.w); }
};

struct ImuMessage {
  static constexpr const char* name = "sensor_msgs/Imu";
  RosHeader header;
  QuaternionMessage orientation;
  std::array<double, 9> orientation_covariance{};
  Vector3Message angular_velocity;
  std::array<double, 9> angular_velocity_covariance{};
  Vector3Message linear_acceleration;
  std::array<double, 9> linear_acceleration_covariance{};

  static void fields(auto& m, auto&& visit) {
    visit(m.header, m.orientation, m.orientation_covariance, m.angular_velocity, m.angular_velocity_covariance, m.linear_acceleration,
          m.linear_acceleration_covariance);
  }
};

struct JointStateMessage {
  static constexpr const char* name = "sensor_msgs/JointState";
  RosHeader header;
  std::vector<std::string_view> names;
  Numbers<double> position, velocity, effort;

  static void fields(auto& m, auto&& visit) { visit(m.header, m.names, m.position, m.velocity, m.effort); }
};

struct PointFieldMessage {
  std::string_view name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = 0;
  std::uint32_t count = 1;

  static void fields(auto& m, auto&& visit) { visit(m.name, m.offset, m.datatype, m.count); }
};

struct PointCloud2Message {
  static constexpr const char* name = "sensor_msgs/PointCloud2";
  RosHeader header;
  std::uint32_t height = 1, width = 0;
  std::vector<PointFieldMessage> point_fields;
  std::uint8_t is_bigendian = 0;
  std::uint32_t point_step = 0, row_step = 0;
  Numbers<std::uint8_t> data;
  std::uint8_t is_dense = 1;

  static void fields(auto& m, auto&& visit) {
    visit(m.header, m.height, m.width, m.point_fields, m.is_bigendian, m.point_step, m.row_step, m.data, m.is_dense);
  }
};

struct ImageMessage {
  static constexpr const char* name = "sensor_msgs/Image";
  RosHeader header;
  std::uint32_t height = 0, width = 0;
  std::string_view encoding;
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;
  Numbers<std::uint8_t> data;

  static void fields(auto& m, auto&& visit) { visit(m.header, m.height, m.width, m.encoding, m.is_bigendian, m.step, m.data); }
};

struct CompressedImageMessage {
  static constexpr const char* name = "sensor_msgs/CompressedImage";
  RosHeader header;
  std::string_view format;
  Numbers<std::uint8_t> data;

  static void fields(auto& m, auto&& visit) { visit(m.header, m.format, m.data); }
};

/// livox_ros_driver/CustomPoint: uint32 offset_time, float32 x y z, uint8 reflectivity, tag, line.
struct LivoxPoint {
  static constexpr std::size_t wire_bytes = 19, wire_alignment = 4;
};

/// The same of livox_ros_driver and livox_ros_driver2.
struct LivoxMessage {
  static constexpr const char* name = "livox CustomMsg";
  RosHeader header;
  std::uint64_t timebase = 0;
  std::uint32_t point_num = 0;
  std::uint8_t lidar_id = 0;
  std::array<std::uint8_t, 3> rsvd{};
  Structs<LivoxPoint> points;

  static void fields(auto& m, auto&& visit) { visit(m.header, m.timebase, m.point_num, m.lidar_id, m.rsvd, m.points); }
};

}  // namespace kilvo::lab
