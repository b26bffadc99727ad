#include "lab/run_log/run_log.hpp"

#include "lab/messages/ros_types.hpp"
#include "lab/messages/wire_writer.hpp"

namespace kilvo::lab {
namespace {

constexpr const char* world = "map";
constexpr const char* body = "imu";
constexpr Duration tf_period = std::chrono::milliseconds(10);
constexpr std::size_t most_points = 10'000;  // of a sweep

struct PoseMessage {
  Vector3Message position;
  QuaternionMessage orientation;

  static void fields(auto& m, auto&& visit) { visit(m.position, m.orientation); }
};

struct OdometryMessage {
  RosHeader header;
  std::string_view child_frame_id;
  PoseMessage pose;
  std::array<double, 36> pose_covariance{};  // position, then rotation, about the axes of the world
  Vector3Message linear, angular;            // in the axes of the child
  std::array<double, 36> twist_covariance{};

  static void fields(auto& m, auto&& visit) {
    visit(m.header, m.child_frame_id, m.pose, m.pose_covariance, m.linear, m.angular, m.twist_covariance);
  }
};

struct TransformMessage {
  RosHeader header;
  std::string_view child_frame_id;
  PoseMessage transform;

  static void fields(auto& m, auto&& visit) { visit(m.header, m.child_frame_id, m.transform); }
};

struct TransformsMessage {
  std::vector<TransformMessage> transforms;

  static void fields(auto& m, auto&& visit) { visit(m.transforms); }
};

struct TextMessage {
  std::string_view data;

  static void fields(auto& m, auto&& visit) { visit(m.data); }
};

constexpr const char* timing_type = "kilvo_msgs/StageTimes";
constexpr const char* timing_definition =
    "time stamp\nfloat64 lidar_us\nfloat64 map_us\nfloat64 other_us\nfloat64 visual_us\nfloat64 kinematic_us\nfloat64 contact_us\n";
struct TimingMessage {
  Time stamp{};
  StageTimes stages;
  double kinematic_us = 0, contact_us = 0;

  static void fields(auto& m, auto&& visit) {
    visit(m.stamp, m.stages.lidar_us, m.stages.map_us, m.stages.other_us, m.stages.visual_us, m.kinematic_us, m.contact_us);
  }
};

Vector3Message message_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

PoseMessage message_of(const SE3& T) {
  const Eigen::Quaterniond q = T.R.quaternion();
  return {message_of(T.p), {q.x(), q.y(), q.z(), q.w()}};
}

void put_block(std::array<double, 36>& to, int at, const Eigen::Matrix3d& block) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) to[static_cast<std::size_t>(6 * (at + row) + at + column)] = block(row, column);
  }
}

template <class Message>
void send(MessageLog& log, const char* topic, const char* type, Time t, const Message& message, std::string_view definition = {}) {
  log.write(topic, type, t, write_message(message, Encoding::cdr), definition);
}

}  // namespace

void RunLog::write_state(const Output& output) {
  write_odometry(output);
  if (!last_tf_ || output.t - *last_tf_ >= tf_period) write_transform(output);
  if (output.contacts) {
    write_contacts(*output.contacts);
    write_timing(output);
  }
  if (modality_ == output.modality) return;
  modality_ = output.modality;
  send(log_, "/kilvo/modality", "std_msgs/String", output.t, TextMessage{name_of(output.modality)});
}

void RunLog::write_sweep(const Output& output) {
  if (output.is_sweep) write_cloud(output);
  if (output.is_sweep || output.is_image) write_timing(output);
  for (const Event& event : output.events) {
    const std::string text = text_of(event);
    send(log_, "/kilvo/events", "std_msgs/String", output.t, TextMessage{text});
  }
}

void RunLog::write_odometry(const Output& output) {
  OdometryMessage m;
  const Eigen::Matrix3d R = output.x.R.matrix();
  m.header = {{}, output.t, world};
  m.child_frame_id = body;
  m.pose = message_of(output.x.pose());
  m.linear = message_of(R.transpose() * output.x.v);
  m.angular = message_of(output.omega);
  // The state's rotation error is about the axes of the IMU, a pose of ROS has it about those of the world; velocities the other way round.
  put_block(m.pose_covariance, 0, output.P.block<3, 3>(at::p, at::p));
  put_block(m.pose_covariance, 3, R * output.P.block<3, 3>(at::R, at::R) * R.transpose());
  put_block(m.twist_covariance, 0, R.transpose() * output.P.block<3, 3>(at::v, at::v) * R);
  put_block(m.twist_covariance, 3, output.P.block<3, 3>(at::bg, at::bg));
  send(log_, "/kilvo/odometry", "nav_msgs/Odometry", output.t, m);
}

void RunLog::write_transform(const Output& output) {
  last_tf_ = output.t;
  const TransformsMessage m{{{{{}, output.t, world}, body, message_of(output.x.pose())}}};
  send(log_, "/tf", "tf2_msgs/TFMessage", output.t, m);
}

void RunLog::write_contacts(const Contacts& contacts) {
  const std::vector<double> clearance(contacts.clearance.begin(), contacts.clearance.end());
  const std::vector<double> motion(contacts.d_fv.begin(), contacts.d_fv.end());
  const std::vector<double> on{contacts.on[0] ? 1.0 : 0.0, contacts.on[1] ? 1.0 : 0.0};
  const JointStateMessage m{
      {{}, contacts.t, body}, {feet_[0], feet_[1]}, Numbers<double>::of(clearance), Numbers<double>::of(motion), Numbers<double>::of(on)};
  send(log_, "/kilvo/contacts", "sensor_msgs/JointState", contacts.t, m);
}

void RunLog::write_cloud(const Output& output) {
  constexpr std::uint8_t float32 = 7;
  const auto& points = output.points_W;
  const std::size_t step = points.size() / most_points + 1;
  std::vector<float> values;
  values.reserve(4 * (points.size() / step + 1));
  for (std::size_t i = 0; i < points.size(); i += step) {
    values.insert(values.end(), points[i].data(), points[i].data() + 4);  // x, y, z, intensity
  }
  PointCloud2Message m;
  m.header = {{}, output.t, world};
  m.width = static_cast<std::uint32_t>(values.size() / 4);
  m.point_fields = {{"x", 0, float32}, {"y", 4, float32}, {"z", 8, float32}, {"intensity", 12, float32}};
  m.point_step = 4 * sizeof(float);
  m.row_step = m.width * m.point_step;
  m.data.raw = Numbers<float>::of(values).raw;
  send(log_, "/kilvo/cloud", "sensor_msgs/PointCloud2", output.t, m);
}

void RunLog::write_timing(const Output& output) {
  const TimingMessage m{output.t, output.stages, output.kinematic_us, output.contact_us};
  send(log_, "/kilvo/timing", timing_type, output.t, m, timing_definition);
}

}  // namespace kilvo::lab
