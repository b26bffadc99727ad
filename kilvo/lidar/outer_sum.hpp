// Sums of weighted outer products of six numbers, which is what most of a registration's time goes into.
#pragma once

#include <array>
#include <cstddef>

#include "kilvo/filter/state.hpp"

namespace kilvo {

/// A row g with its weight and residual; a line of the cache.
struct OuterRow {
  OuterRow() = default;
  OuterRow(const Eigen::Matrix<double, 6, 1>& row, double weight, double residual = 0)
      : g{row[0], row[1], row[2], row[3], row[4], row[5]}, w(weight), r(residual) {}
  std::array<double, 6> g;
  double w, r;
};
static_assert(sizeof(OuterRow) == 64);

/// Sum of w g g'. Rows are added one after the other: the sum does not depend on how many come at once.
class OuterSum {
 public:
  void add(const OuterRow* rows, std::size_t count);
  /// Its lower triangle; zero above.
  PoseCovariance lower() const;

 private:
  std::array<std::array<double, 4>, 6> part_{};  // the upper four rows of the first four columns, by column; below them rows 4 and 5
  std::array<double, 3> corner_{};               // (4, 4), (5, 4), (5, 5)
};

}  // namespace kilvo
