// What the estimator reports beside its states: counts of messages, events, and contradictions between two sensors.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "kilvo/estimator/event.hpp"
#include "kilvo/estimator/modality.hpp"
#include "kilvo/estimator/output.hpp"
#include "kilvo/filter/state.hpp"
#include "kilvo/input/clock_steps.hpp"
#include "kilvo/input/health.hpp"

namespace kilvo {

class Findings {
 public:
  /// The estimator's data when a finding is judged.
  struct Situation {
    Time t;                    // of the estimate; before there is one, of the IMU
    const Estimate& estimate;  // anything before there is one
    const Health& health;
    Modality modality;
    double accel_noise;       // density as it is taken, m/s^2/sqrt(Hz)
    double configured_noise;  // the same in the settings
    bool legs_used;
    Time last_used_stance;
    double leg_length;  // m
  };

  void use(Sensor s) { ++of(s).used; }
  /// An image was good enough to carry the estimate.
  void camera_carries() { camera_carried_ = true; }
  /// A message that is not used. `text`: more exact than the reason's.
  void drop(Sensor s, Reason reason, const std::string& text = {});
  /// It became true (again).
  void report(const Situation& now, std::optional<Sensor> sensor, Reason reason, double value = 0, std::string detail = {});
  /// A sample at the end of the IMU's range; `count` of them until now.
  void report_clipping(const Situation& now, const ImuSample& s, std::uint64_t count);
  /// The IMU is back after so long, s.
  void report_gap(const Situation& now, double gap);
  /// The IMU's clock has stepped again, and its stamps are put right since.
  void report_clock_steps(const Situation& now, const ClockSteps& steps);
  /// A sensor's clock was found to be off the IMU's: `total` s is added to its stamps from now on, beside the `configured` ones.
  void report_clock_offset(const Situation& now, Sensor s, double total, double configured);
  /// The camera is turned by `turned` rad about the IMU's axes against its description; `corrected`: its rotation from now on.
  void report_turned_camera(const Situation& now, const Eigen::Vector3d& turned, const std::optional<SO3>& corrected);
  /// No sweep had fitted for so long that the map was restarted.
  void report_new_map(const Situation& now);
  /// A sweep or an image was registered. `along`: a direction of the position that no sensor measured, none if all are.
  void note_unmeasured(const Situation& now, const std::optional<Eigen::Vector3d>& along);
  /// `a` and `b` contradict each other.
  void contradict(Reason reason, Sensor a, Sensor b, double value, const std::string& why, const Situation& now);
  /// Which other sensor carried the estimate until now.
  static Sensor witness_against(Sensor s, const Situation& now);

  /// Once a second of the data's time looks at the streams and at what was made of them.
  void look(Time t, const Situation& now);
  /// The last look: at all there was.
  void finish(const Situation& now);

  /// Those that have not gone out yet.
  std::vector<Event> take_events() { return events_.take(); }
  bool has_news() const { return events_.has_news(); }

  Statistics& statistics() { return statistics_; }
  const Statistics& statistics() const { return statistics_; }

  /// Of an epoch that begins: the counts go on, what was remembered of the estimate does not.
  Findings next_epoch();

 private:
  struct Use {
    std::array<std::uint64_t, sensor_count> used{};
    std::array<std::array<std::uint64_t, reason_count>, sensor_count> dropped{};
    std::uint64_t unsupported = 0;
  };
  SensorCount& of(Sensor s) { return statistics_.sensors[index_of(s)]; }
  void report_streams(const Situation& now);
  void report_use(const Use& before, const Situation& now);
  void judge_stances(const Situation& now);
  void judge_speed(const Situation& now);
  void judge_biases(const Situation& now);
  void judge_coasting(const Situation& now);

  Statistics statistics_;
  EventLog events_;
  std::array<std::array<std::uint64_t, reason_count>, sensor_count> drops_{};  // by Sensor and Reason
  std::string joint_fault_;                                                    // of the last message whose joints were wrong
  bool camera_carried_ = false;                                                // an image has, since the start
  Use used_before_;
  Time streams_looked_at_{}, use_looked_at_{};
  struct Biases {
    Eigen::Vector3d accel, gyro;  // m/s^2, rad/s
  };
  std::optional<Biases> first_biases_, known_biases_;  // at the start; when they were known
  std::optional<Time> impossible_since_;
  bool strange_biases_ = false;
  struct Unmeasured {
    std::optional<Time> since;
    bool reported = false;  // this stretch
    double longest = 0;     // s
    std::uint64_t stretches = 0;
    /// Of a stretch that goes on at `now`; true once it has lasted for `least`.
    bool goes_on(Time now, Duration least);
    void end() { since.reset(), reported = false; }
  };
  Unmeasured unmeasured_, coasting_;
  std::uint64_t lost_stances_before_ = 0;
};

}  // namespace kilvo
