#include "lab/simulation/description.hpp"

#include <cmath>
#include <fmt/core.h>

namespace kilvo::lab {
namespace {

std::string list_of(const Eigen::Vector3d& v) { return fmt::format("[{:.10g}, {:.10g}, {:.10g}]", v.x() + 0.0, v.y() + 0.0, v.z() + 0.0); }

// Row by row; what is zero but for rounding is written as zero.
std::string list_of(const SO3& R) {
  std::string out;
  for (int i = 0; i < 9; ++i) {
    const double x = R.matrix()(i / 3, i % 3);
    out += fmt::format("{}{:.10g}", i == 0 ? "[" : ", ", std::abs(x) < 1e-12 ? 0.0 : x);
  }
  return out + "]";
}

// Nothing for a clock that is right.
std::string offset_line(const Delivery& d) { return d.offset == 0 ? "" : fmt::format("  time_offset: {:.10g}\n", -d.offset); }

std::string foot_line(const char* name, const BipedShape& shape) {
  std::string corners;
  for (const Eigen::Vector3d& c : shape.sole()) corners += (corners.empty() ? "" : ", ") + list_of(c);
  return fmt::format("    - {{name: {}, link: {}_ankle_roll_link, sole: [{}]}}\n", name, name, corners);
}

std::string camera_section(const SimulatorConfig& config) {
  const CameraModel& m = config.camera;
  const SE3 T = config.shape.T_torso_imu().inverse() * m.T_torso_camera;
  return fmt::format(
             "\ncamera:\n  topic: {}\n  rate: {}\n  T_imu_camera:\n    p: {}\n    R: {}\n  model: pinhole_radtan\n  width: {}\n  height: "
             "{}\n"
             "  fx: {:.10g}\n  fy: {:.10g}\n  cx: {}\n  cy: {}\n  distortion: [{:.10g}, {:.10g}, {:.10g}, {:.10g}]\n",
             simulated_topics()[3], m.delivery.rate, list_of(T.p), list_of(T.R), m.width, m.height, m.fx, m.fy, m.cx, m.cy, m.distortion[0],
             m.distortion[1], m.distortion[2], m.distortion[3]) +
         offset_line(m.delivery);
}

}  // namespace

std::array<std::string, sensor_count> simulated_topics() { return {"/imu", "/joint_states", "/points", "/camera/image_raw"}; }

std::string simulated_config(const SimulatorConfig& config, const std::string& urdf) {
  const BipedShape& shape = config.shape;
  const auto topics = simulated_topics();
  const SE3 T_torso_imu = shape.T_torso_imu();
  std::string out =
      "# The humanoid of `kilvo simulate`: 12 leg joints and the waist, IMU and a LiDAR that hangs upside down on the torso.\n";
  out += fmt::format("robot:\n  urdf: {}\n  feet:\n", urdf) + foot_line("left", shape) + foot_line("right", shape);
  out += fmt::format("\nimu:\n  topic: {}\n  rate: {}\n", topics[0], config.imu.delivery.rate);
  out += fmt::format("  gyro_noise: {:.10g}\n  accel_noise: {:.10g}\n", config.imu.gyro_noise, config.imu.accel_noise);
  // Measured with a noise-free IMU from true states over 0.1 s (docs/decisions/covariance.md).
  out += "  velocity_noise: 0.00016  # its impacts ring softly: they alias less than those of a real robot do\n";
  out += fmt::format("  T_link_imu:\n    link: torso_link\n    p: {}\n    R: {}\n", list_of(T_torso_imu.p), list_of(T_torso_imu.R));
  out += fmt::format("\nlegs:\n  topic: {}\n  type: joints\n  rate: {}\n", topics[1], config.joints.delivery.rate);
  out += offset_line(config.joints.delivery);
  out += fmt::format("\nlidar:\n  topic: {}\n  rate: {}\n  range_noise: {}\n  angle_noise: {}\n  T_imu_lidar:\n    p: {}\n    R: {}\n",
                     topics[2], config.lidar.delivery.rate, config.lidar.range_noise, config.lidar.angle_noise,
                     list_of(shape.T_imu_lidar.p), list_of(shape.T_imu_lidar.R));
  out += offset_line(config.lidar.delivery);
  return out + camera_section(config);
}

}  // namespace kilvo::lab
