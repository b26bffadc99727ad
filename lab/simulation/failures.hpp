// What goes wrong with sensors, done on purpose to any source of measurements: a simulation, a recording.
#pragma once

#include <array>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "kilvo/sensors/measurement_source.hpp"
#include "lab/simulation/random.hpp"

namespace kilvo::lab {

enum class FailureKind : std::uint8_t {
  drop,           // the messages are lost
  freeze,         // they come in time, but say what the last one before said
  freeze_half,    // the IMU's accelerometer does (`amount` 0), or its gyro (1), and the other half goes on
  delay,          // they come `amount` seconds later
  not_a_number,   // IMU and joints say NaN; of a scan every second point
  noise,          // Gaussian, sigma `amount`: rad/s and m/s^2, rad, m for each coordinate, grey levels
  time_jump,      // `amount` seconds are added to the stamps
  duplicate,      // each comes twice
  darkness,       // images: grey levels times `amount`
  narrow_sector,  // scans: only points within `amount` / 2 rad of the LiDAR's x axis, all around it in elevation
  textureless,    // images: every pixel is the image's mean
  random_loss,    // each message is lost with the probability `amount`
  vibration,      // the accelerometer shakes at 173 Hz, `amount` m/s^2 at the most
};

/// Befalls the messages of a sensor that arrive in [from, until) seconds after the beginning. What a kind does not apply to stays as it is.
struct Failure {
  FailureKind kind = FailureKind::drop;
  Sensor sensor{};
  double from = 0;
  double until = std::numeric_limits<double>::infinity();
  double amount = 0;
  std::string as_asked = {};  // by the user, for messages
};

class FailingSource final : public MeasurementSource {
 public:
  /// `begin`: what the failures' times count from. `arrival`: when the measurement that `source` gave last arrived; its stamp by default.
  FailingSource(MeasurementSource& source, std::vector<Failure> failures, Time begin, std::function<Time()> arrival = {},
                std::uint64_t seed = 1);

  /// In the order of arrival.
  std::optional<Measurement> next() override;

  /// When the measurement that next() gave last arrived.
  Time arrived() const { return arrived_; }

  /// Those of the failures that no message has met.
  std::vector<const Failure*> without_effect() const;

  /// Messages lost.
  std::uint64_t dropped(Sensor sensor) const { return dropped_[static_cast<std::size_t>(sensor)]; }

 private:
  void take(Measurement measurement, Time arrived);
  bool is_on(const Failure& failure, Sensor sensor, Time arrived) const;
  void spoil(const Failure& failure, Measurement& measurement);

  MeasurementSource& source_;
  std::vector<Failure> failures_;
  std::vector<bool> met_;  // a message, by index in failures_
  Time begin_;
  std::function<Time()> arrival_;
  Random random_;
  std::deque<std::pair<Time, Measurement>> ready_;  // by when they arrived
  std::multimap<Time, Measurement> held_;           // by when they are due
  Time arrived_{};
  std::array<std::optional<Measurement>, sensor_count> before_;  // the last unspoilt one, for `freeze`
  std::array<std::uint64_t, sensor_count> dropped_{};
};

}  // namespace kilvo::lab
