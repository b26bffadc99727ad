// The ROS messages that a node publishes, field by field, in the order of their definitions (lab/messages/wire_fields.hpp).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "lab/messages/wire_fields.hpp"

namespace kilvo::node {

struct Header {
  lab::Ros1Only<std::uint32_t> seq;
  Time stamp{};
  std::string frame_id;

  static void fields(auto& m, auto&& visit) { visit(m.seq, m.stamp, m.frame_id); }
};

/// geometry_msgs/Point and Vector3.
struct Vector {
  double x = 0, y = 0, z = 0;

  static void fields(auto& m, auto&& visit) { visit(m.x, m.y, m.z); }
};

struct Quaternion {
  double x = 0, y = 0, z = 0, w = 1;

  static void fields(auto& m, auto&& visit) { visit(m.x, m.y, m.z, m.w); }
};

/// geometry_msgs/Pose and Transform.
struct Pose {
  Vector position;
  Quaternion orientation;

  static void fields(auto& m, auto&& visit) { visit(m.position, m.orientation); }
};

struct PoseStamped {
  Header header;
  Pose pose;

  static void fields(auto& m, auto&& visit) { visit(m.header, m.pose); }
};

struct Odometry {
  static constexpr const char* type = "nav_msgs/Odometry";
  Header header;
  std::string child_frame_id;
  Pose pose;
  std::array<double, 36> pose_covariance{};
  Vector linear, angular;  // of the child frame, in its own axes
  std::array<double, 36> twist_covariance{};

  static void fields(auto& m, auto&& visit) {
    visit(m.header, m.child_frame_id, m.pose, m.pose_covariance, m.linear, m.angular, m.twist_covariance);
  }
};

struct TransformStamped {
  Header header;
  std::string child_frame_id;
  Pose transform;

  static void fields(auto& m, auto&& visit) { visit(m.header, m.child_frame_id, m.transform); }
};

struct Transforms {
  static constexpr const char* type = "tf2_msgs/TFMessage";
  std::vector<TransformStamped> transforms;

  static void fields(auto& m, auto&& visit) { visit(m.transforms); }
};

struct Path {
  static constexpr const char* type = "nav_msgs/Path";
  Header header;
  std::vector<PoseStamped> poses;

  static void fields(auto& m, auto&& visit) { visit(m.header, m.poses); }
};

struct Poses {
  static constexpr const char* type = "geometry_msgs/PoseArray";
  Header header;
  std::vector<Pose> poses;

  static void fields(auto& m, auto&& visit) { visit(m.header, m.poses); }
};

struct JointState {
  static constexpr const char* type = "sensor_msgs/JointState";
  Header header;
  std::vector<std::string> names;
  std::vector<double> position, velocity, effort;

  static void fields(auto& m, auto&& visit) { visit(m.header, m.names, m.position, m.velocity, m.effort); }
};

struct PointField {
  static constexpr std::uint8_t float32 = 7;
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = float32;
  std::uint32_t count = 1;

  static void fields(auto& m, auto&& visit) { visit(m.name, m.offset, m.datatype, m.count); }
};

struct PointCloud {
  static constexpr const char* type = "sensor_msgs/PointCloud2";
  Header header;
  std::uint32_t height = 1, width = 0;
  std::vector<PointField> point_fields;
  std::uint8_t is_bigendian = 0;
  std::uint32_t point_step = 0, row_step = 0;
  std::vector<std::uint8_t> data;
  std::uint8_t is_dense = 1;

  static void fields(auto& m, auto&& visit) {
    visit(m.header, m.height, m.width, m.point_fields, m.is_bigendian, m.point_step, m.row_step, lab::Numbers<std::uint8_t>{m.data},
          m.is_dense);
  }
};

struct KeyValue {
  std::string key, value;

  static void fields(auto& m, auto&& visit) { visit(m.key, m.value); }
};

struct DiagnosticStatus {
  enum Level : std::uint8_t { ok = 0, warn = 1, error = 2, stale = 3 };
  std::uint8_t level = ok;
  std::string name, message, hardware_id;
  std::vector<KeyValue> values;

  static void fields(auto& m, auto&& visit) { visit(m.level, m.name, m.message, m.hardware_id, m.values); }
};

struct Diagnostics {
  static constexpr const char* type = "diagnostic_msgs/DiagnosticArray";
  Header header;
  std::vector<DiagnosticStatus> status;

  static void fields(auto& m, auto&& visit) { visit(m.header, m.status); }
};

}  // namespace kilvo::node
