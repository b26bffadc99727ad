// Plausibility of the sensors' messages as they arrive: absurd and repeated values, rate, jitter, clocks. Clipped samples are counted.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "kilvo/sensors/measurement.hpp"
#include "kilvo/sensors/reason.hpp"
#include "kilvo/sensors/robot.hpp"

namespace kilvo {

/// What is wrong with a measurement by itself; none: nothing.
std::optional<Reason> fault_of(const ImuSample& s);
std::optional<Reason> fault_of(const JointSample& s);
std::optional<Reason> fault_of(const Measurement& m);

/// What was seen of one sensor's messages.
struct StreamHealth {
  std::uint64_t messages = 0;
  double mean_interval = 0, jitter = 0, longest_gap = 0;  // s, between stamps; the jitter is a standard deviation
  std::uint64_t repeated = 0;                             // messages that say what the one before said, to the last bit
  std::uint64_t frozen = 0;                               // times that it was taken as frozen
  std::uint64_t clipped = 0;                              // IMU samples at the end of its range
  std::uint64_t off_clock = 0;                            // messages stamped too far ahead of the IMU's newest
  double clock_offset = 0;                                // the mean of those, s
  double mean_lag = 0;                                    // s by which its messages come after the IMU's of the same time
};

class Health {
 public:
  explicit Health(const Robot& robot);

  /// Looks at a message as it arrives. Says why it is not to be used; none when nothing speaks against it.
  std::optional<Reason> judge(const Measurement& m);

  /// Of a sample at the end of the IMU's range; how many there were.
  std::uint64_t count_clipped() { return ++streams_[index_of(Sensor::imu)].clipped; }

  const std::array<StreamHealth, sensor_count>& streams() const { return streams_; }
  /// The newest stamp of a sensor.
  std::optional<Time> heard(Sensor s) const { return trackers_[index_of(s)].stamp; }
  bool is_frozen(Sensor s) const { return trackers_[index_of(s)].frozen; }
  /// How long the others have been speaking since the IMU did last, s: in arrival order, so that a constant delay is no silence.
  double imu_silence() const { return imu_silence_; }

 private:
  struct Tracker {
    std::optional<Time> stamp;            // of the newest
    std::optional<Time> heard_since_imu;  // its first stamp since the IMU spoke last
    double interval_squares = 0;
    int same = 0;       // messages in a row that said the same
    Time same_since{};  // the first of them
    int different = 0;  // messages in a row that did not, until it is known to be alive
    bool frozen = false;
    std::uint64_t imu_then = 0, since = 0;  // IMU messages at the mark, own messages since
    std::uint64_t imu_before = 0, before = 0;
  };
  void time(StreamHealth& stream, Tracker& tracker, Time t);
  struct Half {
    int same = 0, different = 0;  // samples in a row; as in Tracker
  };
  bool half_is_frozen(const ImuSample& imu);
  bool repeats(const Measurement& m);
  bool repeats(const LidarScan& scan);
  std::optional<Reason> judge_repeats(const Measurement& m, StreamHealth& stream, Tracker& tracker);
  bool is_ahead(Sensor s, Time t, StreamHealth& stream, Tracker& tracker);
  void watch_imu(const Measurement& m);

  std::array<double, sensor_count> rates_;
  std::array<StreamHealth, sensor_count> streams_;
  std::array<Tracker, sensor_count> trackers_;
  ImuSample imu_;  // the last
  Half accel_, gyro_;
  std::vector<double> position_, velocity_;  // of the last leg message
  std::vector<Eigen::Vector3f> cloud_;       // points of the last sweep
  std::size_t cloud_size_ = 0;               // points that it had in all
  std::uint64_t picture_ = 0;                // fingerprint of the last image
  double imu_motion_ = 0;                    // rad/s, how much the rate has varied lately
  Eigen::Vector3d gyro_mean_ = Eigen::Vector3d::Zero();
  double imu_silence_ = 0;
};

}  // namespace kilvo
