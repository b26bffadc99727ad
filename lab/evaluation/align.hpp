// Estimate against truth, step one: poses of the same instant, and the rigid motion that lays one trajectory on the other.
#pragma once

#include <optional>
#include <span>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "kilvo/math/se3.hpp"
#include "kilvo/sensors/time.hpp"
#include "lab/evaluation/trajectory_file.hpp"

namespace kilvo::lab {

/// Two trajectories that cannot be compared; the message says why (both spans of time, when they do not overlap).
class EvaluationError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

enum class Alignment {
  se3,    // least squares over all positions, 6 degrees of freedom
  yaw,    // the same, turning about z only: what an estimator that knows gravity cannot observe
  first,  // the first poses coincide
};

constexpr const char* name_of(Alignment a) {
  constexpr const char* names[] = {"se3", "yaw", "first"};
  return names[static_cast<int>(a)];
}
std::optional<Alignment> alignment_of(std::string_view name);

/// One body at one instant: E is the estimate's world, G the truth's.
struct PosePair {
  Time t{};
  SE3 T_E;
  SE3 T_G;
};

/// The truth at the estimates' stamps, one pair per estimate inside the truth's span of time: linear in position, slerp in rotation.
/// Nothing is interpolated across a hole in the truth (longer than ten of its median periods and than 0.1 s). Both must be in the order
/// of time. Throws EvaluationError when fewer than 3 estimates are matched.
std::vector<PosePair> match(std::span<const StampedPose> estimates, std::span<const StampedPose> truth);

/// T_GE, to be applied to the estimate: T_G ~ T_GE * T_E. At least one pair. Where the positions leave the rotation open (they do not move,
/// or move along one line only), the orientations decide.
SE3 align(std::span<const PosePair> pairs, Alignment alignment);

}  // namespace kilvo::lab
