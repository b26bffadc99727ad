// Finds IMU samples at the end of the sensor's range: a setting, or found as the largest acceleration of an axis that comes again, the
// largest rate at which values pile up, or one that is usual.
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
    struct End {
      double largest = 0;    // the size of the largest value until now
      int at = 0, near = 0;  // values of that size; of a little less
    };
    std::array<End, 6> ends{};  // by axis and sign
  };
  static bool count_at(Range::End& end, double size);
  static bool is_at_end(const Eigen::Vector3d& v, Range& range, double least, bool is_smooth, bool (*is_usual)(double));

  Range gyro_, accel_;
};

}  // namespace kilvo
