#include "lab/evaluation/align.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string>

#include "kilvo/math/decompositions.hpp"
#include "lab/evaluation/decimal_time.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t least_matches = 3;

/// How far apart two poses of the truth may be for something between them to be known.
Duration longest_bridge(std::span<const StampedPose> truth) {
  std::vector<Duration> periods;
  periods.reserve(truth.size());
  for (std::size_t i = 1; i < truth.size(); ++i) periods.push_back(truth[i].t - truth[i - 1].t);
  if (periods.empty()) return Duration{0};
  const auto median = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), median, periods.end());
  return std::max(10 * *median, Duration(std::chrono::milliseconds(100)));
}

SE3 interpolate(const StampedPose& a, const StampedPose& b, Time t) {
  const double s = to_seconds(t - a.t) / to_seconds(b.t - a.t);
  return {a.T.R * SO3::Exp(s * (a.T.R.inverse() * b.T.R).Log()), a.T.p + s * (b.T.p - a.T.p)};
}

std::string span_of(std::span<const StampedPose> poses) {
  if (poses.empty()) return "no poses";
  std::string text = std::to_string(poses.size()) + " poses from ";
  append_seconds(text, poses.front().t);
  text += " s to ";
  append_seconds(text, poses.back().t);
  return text + " s";
}

bool in_order(std::span<const StampedPose> poses) {
  return std::is_sorted(poses.begin(), poses.end(), [](const auto& a, const auto& b) { return a.t < b.t; });
}

/// The rotation nearest to `c` (maximum of trace(R^T c)): Umeyama 1991, Eq. 40, without scale.
SO3 nearest_rotation(const Eigen::Matrix3d& c) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(c, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1.0 : 1.0;
  return SO3::nearest(svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose());
}

/// The same among rotations about z.
SO3 nearest_yaw(const Eigen::Matrix3d& c) { return SO3::Exp({0, 0, std::atan2(c(1, 0) - c(0, 1), c(0, 0) + c(1, 1))}); }

/// Sum of outer products truth x estimate of the centred positions (m^2 per pair). Orientations are let in with a weight of 1e-9 m^2: far
/// below any movement worth aligning, enough to decide where there is none.
Eigen::Matrix3d correlation(std::span<const PosePair> pairs, const Eigen::Vector3d& mean_E, const Eigen::Vector3d& mean_G) {
  constexpr double orientation_weight = 1e-9;
  Eigen::Matrix3d positions = Eigen::Matrix3d::Zero(), orientations = Eigen::Matrix3d::Zero();
  for (const PosePair& pair : pairs) {
    positions += (pair.T_G.p - mean_G) * (pair.T_E.p - mean_E).transpose();
    orientations += pair.T_G.R.matrix() * pair.T_E.R.matrix().transpose();
  }
  return (positions + orientation_weight * orientations) / static_cast<double>(pairs.size());
}

}  // namespace

std::optional<Alignment> alignment_of(std::string_view name) {
  for (const Alignment a : {Alignment::se3, Alignment::yaw, Alignment::first})
    if (name == name_of(a)) return a;
  return std::nullopt;
}

std::vector<PosePair> match(std::span<const StampedPose> estimates, std::span<const StampedPose> truth) {
  if (!in_order(estimates) || !in_order(truth)) throw EvaluationError("the poses are not in the order of time");
  const Duration bridge = longest_bridge(truth);
  std::vector<PosePair> pairs;
  pairs.reserve(estimates.size());
  std::size_t next = 0;  // the first pose of the truth that is not before the estimate
  for (const StampedPose& estimate : estimates) {
    while (next < truth.size() && truth[next].t < estimate.t) ++next;
    if (next == truth.size()) break;
    if (truth[next].t == estimate.t) {
      pairs.push_back({estimate.t, estimate.T, truth[next].T});
    } else if (next > 0 && truth[next].t - truth[next - 1].t <= bridge) {
      pairs.push_back({estimate.t, estimate.T, interpolate(truth[next - 1], truth[next], estimate.t)});
    }
  }
  if (pairs.size() < least_matches) {
    throw EvaluationError("only " + std::to_string(pairs.size()) + " estimates lie within the truth's span of time, at least " +
                          std::to_string(least_matches) + " are needed (estimate: " + span_of(estimates) + "; truth: " + span_of(truth) +
                          ")");
  }
  return pairs;
}

SE3 align(std::span<const PosePair> pairs, Alignment alignment) {
  assert(!pairs.empty());
  if (alignment == Alignment::first) return pairs.front().T_G * pairs.front().T_E.inverse();
  Eigen::Vector3d mean_E = Eigen::Vector3d::Zero(), mean_G = Eigen::Vector3d::Zero();
  for (const PosePair& pair : pairs) {
    mean_E += pair.T_E.p;
    mean_G += pair.T_G.p;
  }
  mean_E /= static_cast<double>(pairs.size());
  mean_G /= static_cast<double>(pairs.size());
  const Eigen::Matrix3d c = correlation(pairs, mean_E, mean_G);
  const SO3 R_GE = alignment == Alignment::se3 ? nearest_rotation(c) : nearest_yaw(c);
  return {R_GE, mean_G - R_GE * mean_E};
}

}  // namespace kilvo::lab
