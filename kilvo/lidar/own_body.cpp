#include "kilvo/lidar/own_body.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace kilvo {
namespace {

// Of what stands in the world, a wall along the way and a floor that is as near stay in a cell for longer.
constexpr float share_of_body = 0.3F;
constexpr int fewest_sweeps = 10, remembered_sweeps = 30;
// As far as a cell is wide; from the cells' edge the same angle.
constexpr double other_place = 0.1, other_angle = 0.12;  // m, rad

}  // namespace

OwnBody::OwnBody(std::vector<double> boxes) : boxes_(std::move(boxes)) {
  for (std::size_t k = 0; k + 6 <= boxes_.size(); k += 6) {
    double farthest2 = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      farthest2 += std::pow(std::max(std::abs(boxes_[k + axis]), std::abs(boxes_[k + 3 + axis])), 2);
    reach_ = std::max(reach_, static_cast<float>(std::sqrt(farthest2)));
  }
}

bool OwnBody::is_in_a_box(const LidarPoint& p) const {
  for (std::size_t k = 0; k + 6 <= boxes_.size(); k += 6) {
    const double* const b = &boxes_[k];
    if (p.x >= b[0] && p.x <= b[3] && p.y >= b[1] && p.y <= b[4] && p.z >= b[2] && p.z <= b[5]) return true;
  }
  return false;
}

bool OwnBody::meets(const LidarPoint& p) {
  if (is_in_a_box(p)) return true;
  if (!(p.x * p.x + p.y * p.y + p.z * p.z < learnt_reach * learnt_reach)) return false;
  const auto cell = [](float x) { return std::min(side - 1, static_cast<int>((x + learnt_reach) * (side / (2 * learnt_reach)))); };
  const auto i = static_cast<std::size_t>((cell(p.z) * side + cell(p.y)) * side + cell(p.x));
  hit_[i] = 1;
  return body_[i] != 0;
}

void OwnBody::learn(const SE3& T_WI) {
  // From both: a robot that sways is at two places in turn.
  const auto is_elsewhere = [&T_WI](const std::optional<SE3>& before) {
    if (!before) return true;
    const SE3 T = before->inverse() * T_WI;
    return T.p.norm() > other_place || T.R.Log().norm() > other_angle;
  };
  if (std::ranges::all_of(last_, is_elsewhere)) {
    last_ = {T_WI, last_[0]};
    sweeps_ = std::min(sweeps_ + 1, remembered_sweeps);
    for (std::size_t i = 0; i < share_.size(); ++i) share_[i] += (static_cast<float>(hit_[i]) - share_[i]) / static_cast<float>(sweeps_);
    std::ranges::fill(body_, 0);
    for (int c = 0; sweeps_ >= fewest_sweeps && c < static_cast<int>(share_.size()); ++c) {
      if (share_[static_cast<std::size_t>(c)] < share_of_body) continue;
      const int x = c % side, y = c / side % side, z = c / (side * side);
      for (int k = 0; k < 27; ++k) {
        const int nx = x + k % 3 - 1, ny = y + k / 3 % 3 - 1, nz = z + k / 9 - 1;
        if (std::min({nx, ny, nz}) >= 0 && std::max({nx, ny, nz}) < side) body_[static_cast<std::size_t>((nz * side + ny) * side + nx)] = 1;
      }
    }
  }
}

void OwnBody::begin_sweep() { std::ranges::fill(hit_, 0); }

}  // namespace kilvo
