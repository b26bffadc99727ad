// What enters the estimator: plain structs, SI units, each in its own sensor's frame, stamped with the time of measurement.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "kilvo/sensors/image.hpp"
#include "kilvo/sensors/joint_names.hpp"
#include "kilvo/sensors/time.hpp"

namespace kilvo {

/// Angular rate and specific force in the IMU frame. The acceleration may be in g: the estimator detects it at rest.
struct ImuSample {
  Time t{};
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();    // rad/s
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();   // m/s^2 (or g)
  bool gyro_clipped = false, accel_clipped = false;  // at the end of the sensor's range; found by the estimator
};

/// Joint encoders (or the two-feet message, whose six positions and velocities come without names).
struct JointSample {
  Time t{};
  JointNames names;
  std::vector<double> position;  // rad
  std::vector<double> velocity;  // rad/s, may be empty
  std::vector<double> effort;    // N m, may be empty
};

struct LidarPoint {
  float x = 0, y = 0, z = 0;   // m, LiDAR frame
  float intensity = 0;         // 0..255, sensor's own scale
  std::int32_t offset_ns = 0;  // time of this point minus LidarScan::t
};

/// Of the points of a scan: its first and its last offset.
struct OffsetRange {
  std::int32_t first = 0, last = 0;  // ns
};

/// One LiDAR message. Points need not be sorted by time, may be non-finite or at the origin: the estimator drops and counts those.
struct LidarScan {
  Time t{};  // the time that the points' offsets refer to
  std::vector<LidarPoint> points;
  std::optional<OffsetRange> offsets = {};  // of these points, once they have been looked at
};

inline OffsetRange offsets_of(const LidarScan& scan) {
  if (scan.offsets) return *scan.offsets;
  if (scan.points.empty()) return {};
  OffsetRange out{scan.points.front().offset_ns, scan.points.front().offset_ns};
  for (const LidarPoint& p : scan.points) out = {std::min(out.first, p.offset_ns), std::max(out.last, p.offset_ns)};
  return out;
}

/// When the first and when the last point of a scan were taken.
inline Time begin_of(const LidarScan& scan) { return scan.t + Duration(offsets_of(scan).first); }
inline Time end_of(const LidarScan& scan) { return scan.t + Duration(offsets_of(scan).last); }

struct CameraImage {
  Time t{};
  Image image;
  bool colours = true;  // of the points that it shows are wanted
};

using Measurement = std::variant<ImuSample, JointSample, LidarScan, CameraImage>;

/// In the order of the alternatives of Measurement.
enum class Sensor : std::uint8_t { imu, legs, lidar, camera };
inline constexpr std::size_t sensor_count = std::variant_size_v<Measurement>;
inline constexpr std::array all_sensors = {Sensor::imu, Sensor::legs, Sensor::lidar, Sensor::camera};
static_assert(all_sensors.size() == sensor_count);
constexpr std::size_t index_of(Sensor s) { return static_cast<std::size_t>(s); }

/// The name used on the command line and in files: "imu", "legs", "lidar", "camera".
constexpr const char* name_of(Sensor s) {
  constexpr std::array<const char*, sensor_count> names = {"imu", "legs", "lidar", "camera"};
  return names[index_of(s)];
}

inline Sensor sensor_of(const Measurement& m) { return static_cast<Sensor>(m.index()); }

inline Time stamp_of(const Measurement& m) {
  return std::visit([](const auto& x) { return x.t; }, m);
}

}  // namespace kilvo
