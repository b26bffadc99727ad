// The one way of a measurement into the estimator: clock correction, plausibility, ordering. What does not pass is refused with a reason.
#pragma once

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "kilvo/input/clock_steps.hpp"
#include "kilvo/input/health.hpp"
#include "kilvo/input/timeline.hpp"
#include "kilvo/sensors/robot.hpp"

namespace kilvo {

class InputQueue {
 public:
  /// `used`: by Sensor; what others send is refused. `max_wait`, `wait_for_images`: see Timeline.
  InputQueue(const Robot& robot, std::array<bool, sensor_count> used, Duration max_wait, bool wait_for_images);

  /// Takes a measurement in the order of its arrival. Nothing of what came before is lost by it.
  void push(Measurement m);

  /// The next measurement in the order of time, if it need not wait.
  std::optional<Measurement> pop() { return timeline_.pop(); }

  /// No more measurements will come: nothing waits any longer.
  void end();

  /// What was not let through since the last call.
  std::vector<Refusal> take_refused() { return std::exchange(refused_, {}); }

  /// All time went back by more than an estimator looks back: another recording, or the same again. The measurement that showed it is
  /// held until next_epoch(); the queue of that epoch has seen it and nothing else.
  bool time_went_back() const { return first_of_next_.has_value(); }
  InputQueue next_epoch();

  /// The clock of a camera or a LiDAR was found to be off the IMU's: from now on its stamps are later by so much more. Returns by how much
  /// they are later in all, s, which is bounded.
  double shift_by(Sensor s, double by);

  const Robot& robot() const { return robot_; }
  bool uses(Sensor s) const { return used_[index_of(s)]; }
  const std::array<bool, sensor_count>& used() const { return used_; }
  const ClockSteps& clock_steps() const { return clock_steps_; }
  /// Of the messages as they have arrived until now.
  const Health& health() const { return health_; }
  Health& health() { return health_; }

 private:
  void admit(Measurement m, std::optional<Reason> off_clock);
  void settle_doubted();
  void refuse(Sensor s, Reason r) { refused_.push_back({s, r}); }

  Robot robot_;
  std::array<bool, sensor_count> used_;
  Duration max_wait_;
  bool wait_for_images_;
  ClockSteps clock_steps_;
  Health health_;
  Timeline timeline_;
  std::array<Duration, sensor_count> shift_{};  // added to the stamps, by Sensor
  std::vector<Refusal> refused_;
  struct Held {
    Measurement measurement;
    std::optional<Reason> off_clock;
  };
  std::optional<Held> first_of_next_;
  std::optional<Measurement> doubted_;  // of the IMU: the next one shows whether its stamp is right
};

}  // namespace kilvo
