// What comes before the first estimate: waits until there is one, and keeps what will be of use then.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "kilvo/estimator/initialise.hpp"
#include "kilvo/sensors/measurement.hpp"

namespace kilvo {

class Starter {
 public:
  explicit Starter(const EstimatorConfig& config)
      : initialiser_(config.initial, config.gravity_align, config.noise.accel),
        moving_start_(config.initial.moving_start),
        still_time_(from_seconds(config.initial.still_time)) {}

  /// In time order. The start, as soon as there is one.
  std::optional<Start> add(Measurement m);

  /// What was kept, in the order of time.
  std::deque<Measurement> take_kept() { return std::exchange(kept_, {}); }
  /// Sensors of the measurements that were not kept since the last call.
  std::vector<Sensor> take_dropped() { return std::exchange(dropped_, {}); }

  /// What it waits for, in words.
  std::string waiting_for() const { return initialiser_.waiting_for(); }

 private:
  void bound_images();

  Initialiser initialiser_;
  double moving_start_;  // s
  Duration still_time_;
  std::deque<Measurement> kept_;
  std::vector<Sensor> dropped_;
};

}  // namespace kilvo
