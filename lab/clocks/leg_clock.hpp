// Puts leg samples without a trustworthy clock onto the clock of the IMU (setting legs.clock).
//
// Three things are between them. The device's counter against its arrival, and the IMU's stamps against theirs, drift: both are regressed
// (device_clock.hpp). What is left, the difference of two delays, is constant but for small changes: it is found by comparing the IMU's
// angular rate with the one that the legs' messages tell, through the joints in between (rate_offset.hpp).
#pragma once

#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "kilvo/math/field.hpp"
#include "kilvo/sensors/measurement.hpp"
#include "lab/clocks/device_clock.hpp"
#include "lab/clocks/link_kinematics.hpp"
#include "lab/clocks/rate_offset.hpp"

namespace kilvo::lab {

struct LegClockConfig {
  std::string clock = "stamp";  // stamp | arrival | estimated
  std::string gyro_link;        // URDF link of the gyroscope that is read with the encoders

  static constexpr auto fields() {
    return std::tuple{
        Field{
            "clock", &LegClockConfig::clock, "-",
            "when a leg sample was taken: stamp (as it says), arrival (when it came, without the jitter) or estimated (the same, put onto "
            "the IMU's clock by comparing angular rates)"},
        Field{
            "gyro_link", &LegClockConfig::gyro_link, "-",
            "clock estimated: link of the URDF whose axes the gyroscope has that is read with the encoders (Unitree: pelvis); empty: none, "
            "and the foot that stands tells the rate"}};
  }
};

/// What a robot's low-level state says besides its joints.
struct LowLevel {
  std::optional<std::uint32_t> tick = {};    // ms, wraps around: in place of a stamp
  std::optional<Eigen::Vector3d> gyro = {};  // rad/s, in the axes of LegClockConfig::gyro_link
};

class LegClock {
 public:
  /// Throws std::invalid_argument when the URDF cannot be used.
  LegClock(const LegClockConfig& config, const Robot& robot);

  /// Each measurement in the order of arrival: the time of a leg sample becomes the IMU's. Says why one is not to be used (nullptr: it is):
  /// its time is not known yet, and the robot moves. `low_level`: of
  /// what comes from a low-level state. An IMU that comes from there as well has the legs' clock.
  const char* follow(Measurement& m, Time arrived, const LowLevel& low_level = {});
  bool is_needed() const { return mode_ != Mode::stamp; }

  /// What was found: added to the legs' times of arrival, so that they trail the IMU's by nothing, s.
  std::optional<double> offset() const { return rates_.offset(); }
  /// Leg samples that were not used since their time was not known.
  std::uint64_t withheld() const { return withheld_; }

 private:
  void follow(ImuSample& s, Time arrived, const LowLevel& low_level);
  const char* follow(JointSample& s, Time arrived, const LowLevel& low_level);
  void add_rates(const JointSample& s, const LowLevel& low_level);

  enum class Mode : std::uint8_t { stamp, arrival, estimated };
  Mode mode_;
  double time_offset_;
  std::vector<LinkKinematics> links_;  // of the gyroscope, or of both feet
  bool with_gyro_;
  bool imu_is_beside_ = false;  // in the same messages as the joints
  DeviceClock legs_, imu_;
  TickCounter tick_;
  RateOffset rates_;
  Duration imu_ahead_{};  // of the IMU's stamps before the computer's clock
  std::uint64_t withheld_ = 0;
};

}  // namespace kilvo::lab
