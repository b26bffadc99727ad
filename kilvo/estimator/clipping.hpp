// Finds IMU samples at the end of the sensor's range, where the true value may be anything beyond. The range is a setting, or is found: a
// value that no other of its axis exceeds and that comes again, or one at a range that such sensors have.
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
