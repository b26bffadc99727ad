// Finds IMU samples at the end of the sensor's range: a setting, or found as the largest value of an axis that comes again or is usual.
#pragma once

#include <array>

#include "kilvo/sensors/measurement.hpp"

namespace kilvo {

class ClippingDetector {
 public:
  /// Ranges in rad/s and m/s^2; 0: to be found.
  ClippingDetector(double gyro_range, double accel_range) : gyro_{gyro_range, {}}, accel_{accel_range, {}} {}

  /// Sets gyro_clipped and accel_clipped. Samples in time order, accelerations in m/s^2. Allocates nothing.
  void mark(ImuSample& s);

 private:
  struct Range {
    double given;
    std::array<double, 6> largest;  // by axis and sign: the size of the largest until now
  };
  static bool is_at_end(const Eigen::Vector3d& v, Range& range, double least, bool (*is_usual)(double));

  Range gyro_, accel_;
};

}  // namespace kilvo
