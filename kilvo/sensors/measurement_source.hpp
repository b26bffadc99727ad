// Where measurements come from: a recording, the simulator, a robot.
#pragma once

#include <optional>

#include "kilvo/sensors/measurement.hpp"

namespace kilvo {

class MeasurementSource {
 public:
  virtual ~MeasurementSource() = default;
  /// The next measurement in the order of arrival, or nothing at the end.
  virtual std::optional<Measurement> next() = 0;
};

}  // namespace kilvo
