// Steps of a sensor's clock: a computer that finds its time server while the robot walks sets its clock at once, by milliseconds or
// hours. The stamps jump from one message to the next, and the times of arrival do not.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "kilvo/sensors/time.hpp"

namespace kilvo::lab {

class StampSteps {
 public:
  /// Each message of the sensor, in the order of arrival.
  void note(Time stamp, Time arrived);
  /// Each one of the IMU, from its stamp to its arrival. A step of its clock as well is none between the two.
  void note_imu(Duration delay);

  /// To be added to the sensor's stamps from now on.
  Duration correction() const { return correction_; }
  /// How many steps there were.
  int count() const { return count_; }

 private:
  struct Message {
    Time stamp, arrived;
  };
  /// The stamps jumped; whether the clock did is seen by the delays afterwards.
  struct Jump {
    Duration by, imu_before;
    Time arrived;
    std::vector<Duration> delays, of_imu;
  };
  void conclude();

  std::deque<Duration> delays_, of_imu_;  // of the last messages before a jump
  std::optional<Message> last_;
  double scatter_ = 0;  // s, of the intervals between stamps against those between arrivals: mean of the magnitude
  std::optional<Jump> jump_;
  Duration correction_{};
  int count_ = 0;
};

}  // namespace kilvo::lab
