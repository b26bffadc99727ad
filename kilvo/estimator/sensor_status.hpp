// Which sensors are available and used, and the modality that follows. All decisions on modality are here.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "kilvo/estimator/modality.hpp"
#include "kilvo/input/health.hpp"
#include "kilvo/sensors/reason.hpp"
#include "kilvo/sensors/robot.hpp"

namespace kilvo {

class SensorStatus {
 public:
  /// `settles`: EstimatorConfig::settling.
  explicit SensorStatus(const Robot& robot, bool settles = true);

  /// The first estimate is of `t`. `there`: by Sensor; legs and LiDAR count as used until they are silent.
  void begin(Time t, const std::array<bool, sensor_count>& there);

  /// A measurement of this sensor at `t` (of a scan: its end) updated the estimate.
  void use(Sensor s, Time t);
  /// When it updated the estimate last, or the start; none for legs that are lost.
  std::optional<Time> last_used(Sensor s) const { return tracks_[index_of(s)].used; }
  void lose_legs();
  /// For the live propagator, which does not know the reason: the legs are lost.
  void miss_legs();
  bool has_legs() const { return last_used(Sensor::legs).has_value(); }

  /// The legs have been silent, or frozen, for so long that they count as lost. `imu_heard`: the newest IMU sample before this one; while
  /// the IMU is silent as well, this is not known.
  bool are_legs_lost(Time imu_heard, const Health& health) const;
  bool are_legs_silent(Duration since) const;
  /// While the legs are used, outputs come with their samples; with IMU samples when a leg sample is overdue.
  bool are_legs_overdue(Time t) const;
  /// A leg sample so long after the newest IMU sample cannot be used.
  bool is_imu_missing(Duration since) const;
  /// Whether legs that come back at `t` may be used: an impact would give wrong contacts (paper, Section IV-E), and contacts need a known
  /// velocity. True in any case after a second.
  bool may_legs_return(Time t, bool is_calm, bool is_velocity_known, const Health& health);

  void lose_imu(const Health& health);
  void imu_is_back() { imu_lost_ = false; }
  bool imu_lost() const { return imu_lost_; }

  enum class Change : std::uint8_t { none, of_cause, of_modality };
  /// Decides on the modality of `t` from what was used until then. `of_cause`: only the IMU has come back.
  Change choose(Time t, const Health& health);
  Modality modality() const { return modality_; }
  Reason cause() const { return cause_; }  // of the last change

 private:
  struct Track {
    double rate = 0;                  // Hz, nominal
    std::optional<Time> used;         // last
    std::optional<Time> waits_since;  // messages come again that are not used yet
    bool was_used = false;            // since the start
    bool counts = false;              // as of the last choose()
  };
  Track& track(Sensor s) { return tracks_[index_of(s)]; }
  double rate_of(Sensor s) const { return tracks_[index_of(s)].rate; }
  bool has_waited(Sensor s, Time t);
  Reason cause_of_change(Sensor s, Time t, const Health& health) const;

  std::array<Track, sensor_count> tracks_;  // by Sensor
  bool settles_;
  double leg_period_ = 0;  // between the last two leg samples, s
  bool imu_lost_ = false;
  Modality modality_ = Modality::coast;
  Reason cause_ = Reason::start;
};

}  // namespace kilvo
