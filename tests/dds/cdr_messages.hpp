// Messages as another implementation of CDR writes and reads them.
#pragma once

#include <fastcdr/Cdr.h>
#include <string>
#include <vector>

#include "kilvo/sensors/measurement.hpp"
#include "tests/dds/raw_type.hpp"

namespace kilvo::test {

using eprosima::fastcdr::Cdr;

/// Bytes that grow as they are written.
class CdrBuffer {
 public:
  CdrBuffer() : cdr_(buffer_, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR) { cdr_.serialize_encapsulation(); }
  Cdr& cdr() { return cdr_; }
  RawMessage message() const {
    const char* first = buffer_.getBuffer();
    return {{first, first + cdr_.getSerializedDataLength()}};
  }

 private:
  eprosima::fastcdr::FastBuffer buffer_;
  Cdr cdr_;
};

inline void put_header(Cdr& cdr, Time t, const std::string& frame) {
  constexpr std::int64_t second = 1'000'000'000;
  cdr << static_cast<std::int32_t>(to_ns(t) / second) << static_cast<std::uint32_t>(to_ns(t) % second) << frame;
}

inline void put(Cdr& cdr, const Eigen::Vector3d& v) { cdr << v.x() << v.y() << v.z(); }

inline RawMessage imu_message(const ImuSample& s) {
  CdrBuffer out;
  const std::array<double, 9> unknown{};
  put_header(out.cdr(), s.t, "imu");
  out.cdr() << 0.0 << 0.0 << 0.0 << 1.0 << unknown;
  put(out.cdr(), s.gyro);
  out.cdr() << unknown;
  put(out.cdr(), s.accel);
  out.cdr() << unknown;
  return out.message();
}

inline RawMessage joint_state_message(const JointSample& s) {
  CdrBuffer out;
  put_header(out.cdr(), s.t, "");
  out.cdr() << s.names.list() << s.position << s.velocity << s.effort;
  return out.message();
}

inline RawMessage cloud_message(const LidarScan& scan) {
  constexpr std::uint32_t point_step = 24;
  constexpr std::uint8_t float32 = 7, float64 = 8;
  CdrBuffer out;
  const auto count = static_cast<std::uint32_t>(scan.points.size());
  put_header(out.cdr(), scan.t, "lidar");
  out.cdr() << std::uint32_t{1} << count << std::uint32_t{5};
  std::uint32_t offset = 0;
  for (const char* name : {"x", "y", "z", "intensity", "timestamp"}) {
    out.cdr() << std::string(name) << offset << (offset == 16 ? float64 : float32) << std::uint32_t{1};
    offset += 4;
  }
  std::vector<std::uint8_t> data(std::size_t{count} * point_step);
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const LidarPoint& p = scan.points[i];
    const float xyzi[4] = {p.x, p.y, p.z, p.intensity};
    const auto t = static_cast<double>(to_ns(scan.t) + p.offset_ns);
    std::memcpy(data.data() + i * point_step, xyzi, sizeof xyzi);
    std::memcpy(data.data() + i * point_step + sizeof xyzi, &t, sizeof t);
  }
  out.cdr() << false << point_step << point_step * count << data << true;
  return out.message();
}

inline RawMessage image_message(const CameraImage& s) {
  CdrBuffer out;
  const auto width = static_cast<std::uint32_t>(s.image.width), height = static_cast<std::uint32_t>(s.image.height);
  put_header(out.cdr(), s.t, "camera");
  out.cdr() << height << width << std::string(s.image.channels == 3 ? "rgb8" : "mono8") << std::uint8_t{0}
            << width * static_cast<std::uint32_t>(s.image.channels) << s.image.pixels;
  return out.message();
}

/// What a LowState says of the robot.
struct LowStateModes {
  std::uint8_t pr = 0, machine = 5;
  std::uint32_t crc = 0;
};

/// unitree_hg/LowState: the joints at the places of a G1 with 29, the pelvis' gyroscope, a counter.
inline RawMessage low_state_message(const JointSample& s, const Eigen::Vector3d& gyro, std::uint32_t tick, const LowStateModes& modes) {
  static constexpr std::array<const char*, 13> places{
      "left_hip_pitch_joint",    "left_hip_roll_joint",    "left_hip_yaw_joint",   "left_knee_joint",     "left_ankle_pitch_joint",
      "left_ankle_roll_joint",   "right_hip_pitch_joint",  "right_hip_roll_joint", "right_hip_yaw_joint", "right_knee_joint",
      "right_ankle_pitch_joint", "right_ankle_roll_joint", "waist_yaw_joint"};
  CdrBuffer out;
  Cdr& cdr = out.cdr();
  cdr << std::uint32_t{0} << std::uint32_t{0} << modes.pr << modes.machine << tick;
  cdr << std::array<float, 4>{1, 0, 0, 0};
  cdr << std::array<float, 3>{static_cast<float>(gyro.x()), static_cast<float>(gyro.y()), static_cast<float>(gyro.z())};
  cdr << std::array<float, 3>{0, 0, 9.8F} << std::array<float, 3>{} << std::int16_t{40};
  for (std::size_t motor = 0; motor < 35; ++motor) {
    std::size_t i = s.names.size();
    if (motor < places.size()) i = static_cast<std::size_t>(std::find(s.names.begin(), s.names.end(), places[motor]) - s.names.begin());
    const bool there = i < s.names.size();
    cdr << std::uint8_t{1} << static_cast<float>(there ? s.position[i] : 0) << static_cast<float>(there ? s.velocity[i] : 0) << 0.0F
        << 0.0F;
    cdr << std::array<std::int16_t, 2>{} << 48.0F << std::array<std::uint32_t, 2>{} << std::uint32_t{0} << std::array<std::uint32_t, 4>{};
  }
  cdr << std::array<std::uint8_t, 40>{} << std::array<std::uint32_t, 4>{} << modes.crc;
  return out.message();
}

}  // namespace kilvo::test
