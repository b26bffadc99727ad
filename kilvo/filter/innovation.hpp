// Whether a measurement and the prior disagree by more than their covariances. Their squared distance per degree of
// freedom is 1 on average if both are right, whatever the robot, the sensor and the place: what exceeds that is an error that the
// measurement does not know of (a calibration, a model).
#pragma once

#include <algorithm>
#include <optional>

#include "kilvo/filter/measurement_rows.hpp"
#include "kilvo/filter/state.hpp"

namespace kilvo {

/// Offsets of a clock that are smaller are of no consequence, s.
inline constexpr double least_clock_offset = 5e-4;
/// A wrong clock or mount is so many times what the innovations show (1.2 to 7): the state follows the measurements.
inline constexpr double usual_loss = 1.5;

/// Squared distance per degree of freedom of the pose that `info` speaks of, linearised at the prior, from that of the prior of covariance
/// `P`. None when it does not hold all of the pose. The columns of `info` begin with those of the pose.
std::optional<double> normalised_innovation(const Information<7>& info, const Covariance& P);

/// By how much the variance of a sensor's measurements exceeds their covariance, learnt from their innovations.
class InnovationScale {
 public:
  /// Of one measurement, if it has one.
  void add(std::optional<double> normalised) {
    constexpr double largest = 30, remembered = 30;  // a single one proves little; measurements
    if (!normalised) return;
    count_ = std::min(count_ + 1, remembered);
    mean_ += (std::min(*normalised, largest) - mean_) / count_;
  }
  /// Multiplies the variance: 1 when nothing exceeds. The excess is an error of calibration, common to all measurements of some seconds, so
  /// that it must not shrink with their number.
  double variance() const {
    constexpr double enough = 10, repeated = 10;  // measurements
    return count_ < enough ? 1 : 1 + repeated * std::max(0.0, mean_ - 1);
  }

 private:
  double mean_ = 0, count_ = 0;
};

}  // namespace kilvo
