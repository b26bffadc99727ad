#include "lab/simulation/joint_effort.hpp"

#include <algorithm>

namespace kilvo::lab {
namespace {

constexpr std::array sides{Side::left, Side::right};

}  // namespace

std::array<double, 2> load_shares(const Walk& walk, double t, double ramp) {
  std::array<double, 2> weights{};
  for (std::size_t i = 0; i < 2; ++i) {
    for (const Footprint& print : walk.plan().prints[i]) {
      if (t >= print.touch && t <= print.lift) weights[i] = smooth_step((t - print.touch) / ramp) * smooth_step((print.lift - t) / ramp);
    }
  }
  const double sum = weights[0] + weights[1];
  if (sum <= 0) return {0, 0};
  // Alone on the ground a foot bears everything, but for the first and last moment of a flight.
  const double all = std::min(1.0, 10 * sum);
  return {all * weights[0] / sum, all * weights[1] / sum};
}

JointAngles joint_efforts(const Walk& walk, double t, double mass) {
  constexpr double gravity = 9.80665, h = 1e-6;
  const BipedShape& shape = walk.shape();
  const JointAngles q = walk.joints(t);
  const auto shares = load_shares(walk, t);
  const Eigen::Vector3d up_P = walk.pelvis(t).R.inverse() * Eigen::Vector3d::UnitZ();
  const double force = mass * std::max(0.0, gravity + walk.acceleration(t).z());
  const Eigen::Vector3d middle((shape.heel + shape.toe) / 2, 0, -shape.sole_depth);
  JointAngles out{};
  for (std::size_t i = 0; i < 2; ++i) {
    if (shares[i] == 0) continue;
    LegAngles leg;
    std::copy_n(q.begin() + static_cast<std::ptrdiff_t>(i) * leg_joint_count, leg_joint_count, leg.begin());
    const Eigen::Vector3d point = foot_in_pelvis(shape, sides[i], leg) * middle;
    for (std::size_t k = 0; k < leg.size(); ++k) {
      LegAngles moved = leg;
      moved[k] += h;
      const Eigen::Vector3d column = (foot_in_pelvis(shape, sides[i], moved) * middle - point) / h;
      out[i * leg_joint_count + k] = -column.dot(shares[i] * force * up_P);  // -J^T F
    }
  }
  return out;
}

}  // namespace kilvo::lab
