// Which sensors are there and used, and the modality that follows: all decisions on modality are here.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "kilvo/estimator/modality.hpp"
#include "kilvo/input/health.hpp"
#include "kilvo/sensors/reason.hpp"
#include "kilvo/sensors/robot.hpp"

namespace kilvo {

class SensorStatus {
 public:
  /// `with_lidar`: the LiDAR is to be used. `settling`: see EstimatorConfig.
  SensorStatus(const Robot& robot, bool with_lidar, std::string_view settling = "legs")
      : rates_{robot.imu.rate, robot.legs.rate, robot.lidar.rate, robot.camera.rate},
        with_lidar_(with_lidar),
        settles_all_(settling == "all"),
        settles_nothing_(settling == "none") {}

  /// The first estimate is of `t`. `legs`: they are taken as there until they stay silent.
  void begin(Time t, bool legs);

  /// Something of this sensor at `t` (of a scan: its end) carried the estimate.
  void sweep_used(Time end);
  void image_used(Time t);
  void legs_used(Time t);
  /// `were_there`: they have been used before.
  void lose_legs(bool were_there);
  /// They are lost, and nothing else is asked about: who runs ahead cannot know why.
  void miss_legs();
  bool has_legs() const { return last_legs_.has_value(); }
  std::optional<Time> last_legs() const { return last_legs_; }
  /// End of the last sweep that was used, or the start.
  Time last_sweep() const { return last_sweep_; }

  /// The legs have been silent for so long, or say the same for so long, that they count as lost. `imu_heard`: the newest IMU sample
  /// before this one; where the IMU was silent as well, nobody can say it.
  bool are_legs_lost(Time imu_heard, const Health& health) const;
  bool are_legs_silent(Duration since) const;
  /// While the legs are used their samples carry the outputs, unless one comes so late that the IMU's must.
  bool are_legs_overdue(Time t) const;
  /// Legs so long after the newest IMU sample are no odometry.
  bool is_imu_missing(Duration since) const;
  /// Legs that come again in the middle of an impact would start with wrong contacts (paper, Section IV-E), and which foot stands is told
  /// by what is still, for which the velocity must be known: whether those of `t` may be used, or have waited for long enough.
  bool may_legs_return(Time t, bool is_calm, bool is_velocity_known, const Health& health);

  /// A sweep or image of a sensor that was lost comes in the middle of an impact: it waits as the legs do, but not for ever.
  bool may_frame_return(Sensor s, Time t, bool is_calm);

  /// From now on there is no pose, or there is one again.
  void lose_imu(const Health& health);
  void imu_is_back() { imu_lost_ = false; }
  bool imu_lost() const { return imu_lost_; }

  enum class Change : std::uint8_t { none, of_cause, of_modality };
  /// Decides on the modality of `t` from what was used until then. Of the cause alone: the IMU has come back, and nothing else is there.
  Change choose(Time t, const Health& health);
  Modality modality() const { return modality_; }
  /// Of the last change.
  Reason cause() const { return cause_; }

 private:
  Reason cause_of_change(Time t, Modality now, const Health& health) const;
  double rate_of(Sensor s) const { return rates_[index_of(s)]; }
  bool has_waited(Sensor s, Time t);

  std::array<double, sensor_count> rates_;  // Hz, by Sensor
  bool with_lidar_, settles_all_, settles_nothing_;
  Time last_sweep_{};
  std::optional<Time> last_image_;
  std::optional<Time> last_legs_;                              // while the legs are used
  double leg_period_ = 0;                                      // between the last two leg samples, s
  std::array<std::optional<Time>, sensor_count> waits_since_;  // by Sensor: since when messages come again that are not used yet
  bool legs_were_there_ = false, sweeps_were_there_ = false;
  bool imu_lost_ = false;
  Modality modality_ = Modality::coast;
  Reason cause_ = Reason::start;
};

}  // namespace kilvo
