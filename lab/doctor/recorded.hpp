// What the checks look at: the samples of a recording, by sensor, sorted by their stamps and thinned, without any use of the mounts.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "kilvo/sensors/measurement.hpp"
#include "lab/doctor/feature_tracks.hpp"

namespace kilvo::lab {

/// A LiDAR point and when it was measured.
struct TimedPoint {
  Eigen::Vector3f p;  // m, LiDAR frame
  float t = 0;        // s after the stamp of its sweep
};

struct Sweep {
  double t = 0;                                           // s, stamp
  double begin = 0, end = 0;                              // s, of the first and the last point
  std::shared_ptr<const std::vector<TimedPoint>> points;  // shared by copies
  double duration() const { return end - begin; }
};

struct InertialSample {
  double t = 0;
  Eigen::Vector3d gyro, accel;  // as they came
};

struct LegSample {
  double t = 0;
  std::vector<double> position;
  std::vector<double> velocity;  // may be empty
};

/// Messages that a joint jumps to, to come back in the next one, faster than any joint turns: readings of something else.
struct JointReturns {
  std::size_t count = 0;
  double largest = 0;  // rad
};

struct StampStatistics {
  std::size_t count = 0;
  double period = 0;  // s, median between stamps
};

inline constexpr float far_away = 50;  // m: a robot on the ground sees most of what it sees nearer

/// How the program reads the messages.
struct Reading {
  bool leg_clock_is_found = false;  // by the program (legs.clock): the legs' stamps are no part of the description
  bool without_deskew = false;      // all points of a cloud are taken at its stamp (lidar.deskew): that they have no times is no fault
  bool all_points = false;          // of the sweeps (16 bytes each), to be registered as exactly as they can be: else some thousand
};

/// A joint that reads another position from one message to the next, while the others go on.
struct JointStep {
  double t = 0;  // s
  std::size_t joint = 0;
  double size = 0;  // rad
};

/// Times are seconds since `origin`, the first stamp of all.
struct Recorded {
  std::int64_t origin = 0;  // ns
  std::vector<InertialSample> imu;
  std::vector<std::string> joint_names;
  std::vector<LegSample> legs;  // at most 250 per second
  std::vector<Sweep> sweeps;
  std::size_t points = 0, far_points = 0;  // looked at for sweeps; farther than `far_away`
  std::vector<TrackedPair> tracks;         // of consecutive images
  int image_width = 0, image_height = 0;
  std::array<StampStatistics, sensor_count> stamps;
  std::size_t joint_messages = 0;           // with these names
  std::vector<JointReturns> joint_returns;  // of each joint
  std::vector<JointStep> joint_steps;       // the first few
  Reading reading;
};

/// With every so many points of each sweep left.
Recorded thinned(Recorded recorded, std::size_t step);

/// Takes measurements in the order in which they arrive.
class Recorder {
 public:
  explicit Recorder(const Reading& reading = {}) { recorded_.reading = reading; }
  void push(const Measurement& measurement);
  /// Everything so far, sorted.
  Recorded finish();

 private:
  double seconds(Time t);
  void take(const ImuSample& sample);
  void take(const JointSample& sample);
  void take(const LidarScan& scan);
  void take(const CameraImage& image);
  void note_steps(double t, const std::vector<double>& positions);
  void count_return(double t, const std::vector<double>& positions);

  Recorded recorded_;
  bool begun_ = false;
  std::array<std::vector<double>, sensor_count> times_;
  double last_leg_ = -1e9;
  std::array<LegSample, 2> before_;  // the last two messages of the legs as they came
  FeatureTracker tracker_;
};

}  // namespace kilvo::lab
