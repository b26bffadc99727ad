// What is bolted on: links, mounts, intrinsics, rates. Required, differs per robot, never tuned. T_AB takes a point of B into A.
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "kilvo/math/field.hpp"
#include "kilvo/math/se3.hpp"
#include "kilvo/sensors/measurement.hpp"

namespace kilvo {

struct Foot {
  std::string name;                   // left, right
  std::string link;                   // URDF link of the foot
  std::vector<Eigen::Vector3d> sole;  // corner points of the sole in that link, m
};

struct ImuMount {
  double rate = 200;       // Hz, nominal
  double time_offset = 0;  // s, added to the stamps
  double accel_range = 0;  // m/s^2, 0: found from the data
  double gyro_range = 0;   // rad/s, 0: found from the data
  Eigen::Vector3d gyro_scale = Eigen::Vector3d::Ones();
  std::string link;  // URDF link that T_link_imu refers to
  SE3 T_link_imu;

  static constexpr auto fields() {
    return std::tuple{Field{"rate", &ImuMount::rate, "Hz", "nominal rate of the IMU"},
                      Field{"time_offset", &ImuMount::time_offset, "s", "added to the stamps of the IMU"},
                      Field{"accel_range", &ImuMount::accel_range, "m/s^2", "end of the accelerometer's range; 0: found from the data"},
                      Field{"gyro_range", &ImuMount::gyro_range, "rad/s", "end of the gyroscope's range; 0: found from the data"},
                      Field{"gyro_scale", &ImuMount::gyro_scale, "-", "what the rate about each axis of the gyroscope is multiplied by"}};
  }
};

struct LegsMount {
  std::string type = "joints";          // joints | feet (the two-feet message)
  std::string velocities = "messages";  // messages | positions
  double rate = 1000;                   // Hz, nominal
  double time_offset = 0;               // s, added to the stamps
  SE3 T_imu_feet;                       // two-feet message: its frame in the IMU frame
  double sole_offset = 0;               // two-feet message: from its foot point down to the sole, m

  static constexpr auto fields() {
    return std::tuple{
        Field{"type", &LegsMount::type, "-",
              "what the messages hold: joints (sensor_msgs/JointState by name) or feet (two foot positions)"},
        Field{"velocities", &LegsMount::velocities, "-", "of the joints: those in the messages, or the change of the positions"},
        Field{"rate", &LegsMount::rate, "Hz", "nominal rate of the leg messages"},
        Field{"time_offset", &LegsMount::time_offset, "s", "added to the stamps of the leg messages"},
        Field{"sole_offset", &LegsMount::sole_offset, "m", "two-feet message: distance from its foot point down to the sole"}};
  }
};

struct LidarMount {
  double rate = 10;              // Hz, nominal
  double time_offset = 0;        // s, added to the stamps
  double min_range = 0.3;        // m
  double max_range = 100;        // m
  std::vector<double> own_body;  // boxes around parts of the robot, in the LiDAR's frame, m
  SE3 T_imu_lidar;

  static constexpr auto fields() {
    return std::tuple{
        Field{"rate", &LidarMount::rate, "Hz", "nominal rate of the scans"},
        Field{"time_offset", &LidarMount::time_offset, "s", "added to the stamps of the scans and of their points"},
        Field{"min_range", &LidarMount::min_range, "m", "nearer points are dropped"},
        Field{"max_range", &LidarMount::max_range, "m", "farther points are dropped"},
        Field{"own_body", &LidarMount::own_body, "m",
              "boxes around parts of the robot, in the LiDAR's frame: x, y, z of the least corner, then of the greatest; points in "
              "them are dropped. What is nearer than 0.8 m and goes along with the robot is found without"}};
  }
};

struct CameraMount {
  double rate = 10;                       // Hz, nominal
  double time_offset = 0;                 // s, added to the stamps
  std::string model = "pinhole_radtan";   // pinhole_radtan | equidistant
  int width = 0, height = 0;              // pixels
  double fx = 0, fy = 0, cx = 0, cy = 0;  // pixels
  std::vector<double> distortion;         // k1 k2 p1 p2 [k3], or k1..k4 of the equidistant model
  SE3 T_imu_camera;                       // optical frame: z forward, x right, y down

  static constexpr auto fields() {
    return std::tuple{Field{"rate", &CameraMount::rate, "Hz", "nominal rate of the images"},
                      Field{"time_offset", &CameraMount::time_offset, "s", "added to the stamps of the images"},
                      Field{"model", &CameraMount::model, "-", "pinhole_radtan or equidistant"},
                      Field{"width", &CameraMount::width, "px", "image width"},
                      Field{"height", &CameraMount::height, "px", "image height"},
                      Field{"fx", &CameraMount::fx, "px", "focal length along x"},
                      Field{"fy", &CameraMount::fy, "px", "focal length along y"},
                      Field{"cx", &CameraMount::cx, "px", "principal point x"},
                      Field{"cy", &CameraMount::cy, "px", "principal point y"},
                      Field{"distortion", &CameraMount::distortion, "-", "k1 k2 p1 p2 [k3] (pinhole_radtan) or k1 k2 k3 k4 (equidistant)"}};
  }
};

/// A joint's value is sign times the message's, plus zero; its velocity sign times the message's.
struct JointReading {
  std::string from;           // its name in the messages; empty: as in the URDF
  double sign = 1, zero = 0;  // -, rad (m of a prismatic joint)
  auto operator<=>(const JointReading&) const = default;
};

struct Robot {
  std::string urdf;  // the URDF document itself, not its path
  std::array<Foot, 2> feet;
  std::vector<std::string> locked_joints;
  std::map<std::string, JointReading> joints;  // of the URDF, where the messages hold another name, direction or zero
  ImuMount imu;
  LegsMount legs;
  LidarMount lidar;
  CameraMount camera;
};

/// Nominal, Hz, by Sensor.
inline std::array<double, sensor_count> rates_of(const Robot& r) { return {r.imu.rate, r.legs.rate, r.lidar.rate, r.camera.rate}; }
/// Added to the stamps, s, by Sensor.
inline std::array<double, sensor_count> time_offsets_of(const Robot& r) {
  return {r.imu.time_offset, r.legs.time_offset, r.lidar.time_offset, r.camera.time_offset};
}

}  // namespace kilvo
