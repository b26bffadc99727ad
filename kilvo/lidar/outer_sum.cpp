#include "kilvo/lidar/outer_sum.hpp"

#include <cstring>

namespace kilvo {
namespace {

using Double4 = double __attribute__((vector_size(32)));

KILVO_WIDE void add_up(const OuterRow* rows, std::size_t count, std::array<double, 4>* part, double* corner) {
  std::array<Double4, 6> sum;
  std::memcpy(sum.data(), part, sizeof(sum));
  double s44 = corner[0], s54 = corner[1], s55 = corner[2];
  for (const OuterRow* row = rows; row != rows + count; ++row) {
    Double4 g;
    std::memcpy(&g, row->g.data(), sizeof(g));
    const Double4 wg = row->w * g;
    const double g4 = row->g[4], g5 = row->g[5], w4 = row->w * g4;
    for (std::size_t j = 0; j < 4; ++j) sum[j] += wg[j] * g;
    sum[4] += wg * g4;
    sum[5] += wg * g5;
    s44 += w4 * g4;
    s54 += w4 * g5;
    s55 += row->w * g5 * g5;
  }
  std::memcpy(part, sum.data(), sizeof(sum));
  corner[0] = s44, corner[1] = s54, corner[2] = s55;
}

}  // namespace

void OuterSum::add(const OuterRow* rows, std::size_t count) { add_up(rows, count, part_.data(), corner_.data()); }

PoseCovariance OuterSum::lower() const {
  PoseCovariance A = PoseCovariance::Zero();
  for (std::size_t j = 0; j < 4; ++j) {
    const auto column = static_cast<int>(j);
    for (int i = column; i < 4; ++i) A(i, column) = part_[j][static_cast<std::size_t>(i)];
    A(4, column) = part_[4][j];
    A(5, column) = part_[5][j];
  }
  A(4, 4) = corner_[0], A(5, 4) = corner_[1], A(5, 5) = corner_[2];
  return A;
}

}  // namespace kilvo
