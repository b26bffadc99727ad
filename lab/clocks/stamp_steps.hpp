// Steps of a sensor's clock: a computer that finds its time server while the robot walks, or a LiDAR that finds its PTP master, sets its
// clock at once, by milliseconds or decades. The stamps jump from one message to the next, and another clock shows no such jump.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "kilvo/sensors/time.hpp"
#include "lab/clocks/least_delay.hpp"

namespace kilvo::lab {

class StampSteps {
 public:
  /// How long the messages after a jump are observed (six times as long after one back by over two seconds); at least three of them.
  explicit StampSteps(Duration observed_for = std::chrono::milliseconds(300));

  /// Each message of the sensor, in the order of arrival, by a clock that is never set.
  void note(Time stamp, Time arrived);
  /// A jump is not observed any longer, since the other clock is not known for a while. It is judged by what comes then.
  void postpone();
  /// What was observed is not held against what comes then.
  void interrupt();

  /// The jump that is being observed: whether the clock stepped by it shows in the messages after it.
  std::optional<Duration> pending() const { return jump_ ? std::optional(jump_->by) : std::nullopt; }
  /// To be added to the stamp of a message that arrived then; and to those from now on.
  Duration correction_at(Time arrived) const { return arrived < since_ ? correction_before_ : correction_; }
  Duration correction() const { return correction_; }
  /// When the newest message arrived.
  std::optional<Time> heard() const { return last_ ? std::optional(last_->arrived) : std::nullopt; }
  /// How many steps there were.
  int count() const { return count_; }

 private:
  struct Message {
    Time stamp, arrived;
  };
  struct Jump {
    Duration by;
    Time arrived;
    Message before;
    std::vector<Duration> delays;
  };
  void conclude();

  Duration observed_for_;
  std::deque<Duration> delays_;  // of the last messages before a jump, corrected
  LeastDelay least_;             // of all messages but those after a jump, corrected
  std::optional<Message> last_;
  double scatter_ = 0;  // s, of the intervals between stamps against those between arrivals: mean of the magnitude
  std::optional<Jump> jump_;
  Duration correction_{}, correction_before_{};
  Time since_ = Time::min();  // arrival of the first message after the last step
  int count_ = 0;
};

}  // namespace kilvo::lab
