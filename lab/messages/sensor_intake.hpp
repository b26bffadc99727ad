// The messages of one sensor, from bytes to measurements, and what became of each.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kilvo/sensors/measurement.hpp"
#include "lab/messages/encoding.hpp"
#include "lab/messages/even_stamps.hpp"
#include "lab/messages/joint_assembly.hpp"
#include "lab/messages/point_time.hpp"
#include "lab/messages/repeated_points.hpp"

namespace kilvo::lab {

/// What became of the messages of one sensor.
struct SensorCounts {
  std::uint64_t used = 0;
  std::map<std::string, std::uint64_t> dropped;  // cause -> messages: "undecodable", "too_large"
  std::uint64_t absurd_point_times = 0;          // points, not messages: dropped from their clouds
  std::uint64_t repeated_points = 0;             // that the message before held as well: dropped too
  std::uint64_t unstamped = 0;                   // used, with the time of their arrival because their stamp is 0
  std::uint64_t unused_parts = 0;                // of leg samples: the others did not come in time
};

class SensorIntake {
 public:
  /// `time_offset`: s, added to the stamps (of a scan: to the time that its points count from). `gyro_scale`: of each axis of an IMU.
  /// `with_colours`: images are to give them. `joints`, `with_velocities`: see JointAssembly.
  explicit SensorIntake(double time_offset = 0, const Eigen::Vector3d& gyro_scale = Eigen::Vector3d::Ones(), bool with_colours = true,
                        JointNames joints = {}, bool with_velocities = true)
      : time_offset_(time_offset), gyro_scale_(gyro_scale), with_colours_(with_colours), assembly_(std::move(joints), with_velocities) {}

  /// Nothing when the message cannot be decoded (newest_fault() says why), is a part of a leg sample that the others are not there for, or
  /// has no point that the scan before did not have.
  /// `arrived`: when the message was recorded, or received. `point_time` matters for LiDAR types only.
  /// `type` is a plain_type_name() that is_type_of() the sensor.
  std::optional<Measurement> take(Sensor sensor, std::string_view type, const WireMessage& message, Time arrived,
                                  const PointTimeFormat& point_time);
  /// The message that was taken last is not used after all.
  void take_back(const std::string& cause) {
    --counts_.used;
    ++counts_.dropped[cause];
  }
  /// A message was too large to be looked at.
  void refuse_too_large() { ++counts_.dropped["too_large"]; }

  /// The counter that the last message that was taken has in place of a stamp (ms, wraps around); nothing when it has none.
  const std::optional<std::uint32_t>& tick() const { return tick_; }

  /// The rate of the gyroscope that the last message held beside its joints, rad/s; nothing when it held none.
  const std::optional<Eigen::Vector3d>& gyro() const { return gyro_; }

  /// What the user should know of how the driver writes points and stamps, one sentence each: only more in the course of time.
  std::vector<std::string> findings() const;
  /// How many they are.
  int finding_count() const {
    return (scatter_ > 0 ? 1 : 0) + (lateness_ > 0 ? 1 : 0) + (counts_.repeated_points > 0 ? 1 : 0) +
           (counts_.absurd_point_times > 0 ? 1 : 0);
  }

  const SensorCounts& counts() const { return counts_; }
  /// Why the first undecodable message was; empty without one.
  const std::string& first_fault() const { return first_fault_; }
  /// Of the message that was taken last; empty when it was decoded.
  const std::string& newest_fault() const { return newest_fault_; }

 private:
  double time_offset_;
  Eigen::Vector3d gyro_scale_;
  bool with_colours_;
  JointNames joint_names_;  // of the message that was taken last
  JointAssembly assembly_;
  RepeatedPoints repeated_;
  EvenSweeps even_sweeps_;
  EvenSamples even_samples_;
  std::optional<ImuSample> newest_imu_;  // with the stamp that it came with
  Time imu_stamp_{};                     // that it was given
  double scatter_ = 0, lateness_ = 0;    // s, of stamps for which even ones were used; 0: of none, or too little to be reported
  SensorCounts counts_;
  std::string first_fault_, newest_fault_;
  std::optional<std::uint32_t> tick_;
  std::optional<Eigen::Vector3d> gyro_;
};

}  // namespace kilvo::lab
