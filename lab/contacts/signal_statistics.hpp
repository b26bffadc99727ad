// Mean and standard deviation of a vector signal, element by element, and how far a value deviates from them (paper, Eqs. 17 and 19).
#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace kilvo::lab {

template <int N>
class SignalStatistics {
 public:
  using Vector = Eigen::Matrix<double, N, 1>;

  void add(const Vector& z) {
    ++count_;
    const Vector off = z - mean_;
    mean_ += off / count_;
    squares_ += off.cwiseProduct(z - mean_);
  }

  int count() const { return count_; }
  const Vector& mean() const { return mean_; }
  /// Of the population (Eq. 17: divided by N_g), not below `least`: a signal that never changed has no scale of its own.
  Vector sigma(double least) const { return (squares_ / std::max(count_, 1)).cwiseSqrt().cwiseMax(least); }

  /// |z - mean| / sigma of each element.
  Vector deviation(const Vector& z, double least) const { return (z - mean_).cwiseAbs().cwiseQuotient(sigma(least)); }

 private:
  int count_ = 0;
  Vector mean_ = Vector::Zero(), squares_ = Vector::Zero();
};

}  // namespace kilvo::lab
