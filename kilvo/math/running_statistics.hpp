// Mean and standard deviation of something that is seen again and again, with a memory of a given length.
#pragma once

#include <algorithm>
#include <cmath>

namespace kilvo {

/// Begins with a prior that counts as much as observations of the weight `prior` would; the newest observations of the weight `memory` or
/// so are remembered. Weights are in any one unit: s, observations.
class RunningStatistics {
 public:
  RunningStatistics(double mean, double sigma, double prior, double memory)
      : mean_(mean), variance_(sigma * sigma), weight_(prior), memory_(memory) {}

  void add(double value, double weight) {
    weight_ = std::min(weight_ + weight, memory_);
    const double share = std::min(1.0, weight / weight_), off = value - mean_;
    mean_ += share * off;
    variance_ = (1 - share) * (variance_ + share * off * off);
  }

  double mean() const { return mean_; }
  double sigma() const { return std::sqrt(variance_); }
  double variance() const { return variance_; }
  /// Of the mean square, not of the deviation from the mean.
  double rms() const { return std::sqrt(variance_ + mean_ * mean_); }

 private:
  double mean_, variance_, weight_, memory_;
};

}  // namespace kilvo
