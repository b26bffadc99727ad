#include "lab/evaluation/evaluate.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace kilvo::lab {
namespace {

void absolute_errors(std::span<const PosePair> pairs, Evaluation& result) {
  const SE3 T_GE = align(pairs, result.alignment);
  double translation = 0, rotation = 0, largest = 0;
  for (const PosePair& pair : pairs) {
    const double e2 = (pair.T_G.p - T_GE * pair.T_E.p).squaredNorm();
    translation += e2;
    largest = std::max(largest, e2);
    rotation += (pair.T_G.R.inverse() * (T_GE.R * pair.T_E.R)).Log().squaredNorm();
  }
  const auto n = static_cast<double>(pairs.size());
  result.ate_rmse_m = std::sqrt(translation / n);
  result.ate_max_m = std::sqrt(largest);
  result.rotation_rmse_deg = std::sqrt(rotation / n) * 180.0 / std::numbers::pi;
}

/// Seconds since the first pair.
std::vector<double> elapsed(std::span<const PosePair> pairs) {
  std::vector<double> seconds;
  seconds.reserve(pairs.size());
  for (const PosePair& pair : pairs) seconds.push_back(to_seconds(pair.t - pairs.front().t));
  return seconds;
}

/// Metres the truth has gone since the first pair. Summed over steps of at least 0.1 s (at 1 kHz the truth's own jitter would add up to
/// metres) and spread evenly over the pairs within a step.
std::vector<double> distance(std::span<const PosePair> pairs, std::span<const double> seconds) {
  constexpr double step = 0.1 - 1e-6;
  std::vector<double> metres(pairs.size(), 0.0);
  std::size_t from = 0;
  for (std::size_t to = 1; to < pairs.size(); ++to) {
    if (seconds[to] - seconds[from] < step && to + 1 < pairs.size()) continue;
    const double length = (pairs[to].T_G.p - pairs[from].T_G.p).norm();
    const double span = seconds[to] - seconds[from];
    for (std::size_t i = from + 1; i <= to; ++i) metres[i] = metres[from] + length * (span > 0 ? (seconds[i] - seconds[from]) / span : 1.0);
    from = to;
  }
  return metres;
}

struct RelativeError {
  double rms_m = 0;
  double rms_ratio = 0;  // of the length between the two poses
};

/// Error of the motion from pair i to the first pair at least one unit further `along` (seconds or metres), for start points 1/50 unit
/// apart, so that a pause counts no more than a stride. Where the next pair is more than 1.2 units away, there is nothing to compare.
std::optional<RelativeError> relative_error(std::span<const PosePair> pairs, std::span<const double> along) {
  constexpr double rounding = 1e-9;
  double sum = 0, sum_ratio = 0, next_start = 0;
  std::size_t count = 0, j = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (along[i] < next_start - rounding) continue;
    while (j < pairs.size() && along[j] - along[i] < 1.0 - rounding) ++j;
    if (j == pairs.size()) break;
    next_start = along[i] + 0.02;
    const double length = along[j] - along[i];
    if (length > 1.2) continue;
    const Eigen::Vector3d true_motion = pairs[i].T_G.R.inverse() * (pairs[j].T_G.p - pairs[i].T_G.p);
    const Eigen::Vector3d motion = pairs[i].T_E.R.inverse() * (pairs[j].T_E.p - pairs[i].T_E.p);
    const double e2 = (motion - true_motion).squaredNorm();  // the rotation in front does not change the norm
    sum += e2;
    sum_ratio += e2 / (length * length);
    ++count;
  }
  if (count == 0) return std::nullopt;
  return RelativeError{std::sqrt(sum / static_cast<double>(count)), std::sqrt(sum_ratio / static_cast<double>(count))};
}

void relative_errors(std::span<const PosePair> pairs, Evaluation& result) {
  const std::vector<double> seconds = elapsed(pairs);
  const std::vector<double> metres = distance(pairs, seconds);
  result.path_length_m = metres.back();
  if (const auto error = relative_error(pairs, seconds)) result.rte_1s_m = error->rms_m;
  if (const auto error = relative_error(pairs, metres)) {
    result.rte_1m_m = error->rms_m;
    result.rte_1m_percent = 100.0 * error->rms_ratio;
  }
}

void end_to_end(const PosePair& first, const PosePair& last, Evaluation& result) {
  const Eigen::Vector3d moved_G = last.T_G.p - first.T_G.p, moved_E = last.T_E.p - first.T_E.p;
  const Eigen::Vector3d e = first.T_G.R.inverse() * moved_G - first.T_E.R.inverse() * moved_E;
  result.e2e_m = e.norm();
  result.e2e_z_m = (first.T_G.R * e).z();
  result.e2e_length_m = std::abs(moved_G.norm() - moved_E.norm());
}

double covered_seconds(std::span<const PosePair> pairs) {
  std::vector<Duration> periods;
  periods.reserve(pairs.size());
  for (std::size_t i = 1; i < pairs.size(); ++i) periods.push_back(pairs[i].t - pairs[i - 1].t);
  const auto median = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), median, periods.end());
  const Duration longest = std::max(10 * *median, Duration(std::chrono::seconds(1)));
  Duration covered{0};
  for (const Duration period : periods)
    if (period <= longest) covered += period;
  return to_seconds(covered);
}

void continuity(std::span<const StampedPose> estimates, Evaluation& result) {
  for (std::size_t i = 1; i < estimates.size(); ++i) {
    result.largest_gap_s = std::max(result.largest_gap_s, to_seconds(estimates[i].t - estimates[i - 1].t));
    result.largest_jump_m = std::max(result.largest_jump_m, (estimates[i].T.p - estimates[i - 1].T.p).norm());
  }
  const double span = to_seconds(estimates.back().t - estimates.front().t);
  if (span > 0) result.rate_hz = static_cast<double>(estimates.size() - 1) / span;
}

}  // namespace

Evaluation evaluate(std::span<const StampedPose> estimates, std::span<const StampedPose> truth, Alignment alignment) {
  const std::vector<PosePair> pairs = match(estimates, truth);
  Evaluation result;
  result.alignment = alignment;
  result.estimates = estimates.size();
  result.matches = pairs.size();
  absolute_errors(pairs, result);
  relative_errors(pairs, result);
  end_to_end(pairs.front(), pairs.back(), result);
  continuity(estimates, result);
  result.duration_s = to_seconds(truth.back().t - truth.front().t);
  if (result.duration_s > 0) result.coverage = covered_seconds(pairs) / result.duration_s;
  return result;
}

Divergence judge_divergence(const Evaluation& evaluation) {
  constexpr double share = 0.05, most = 1.0, shortest_walk = 2.0;
  Divergence judged;
  judged.error_m = std::max(evaluation.ate_max_m, evaluation.e2e_m);
  judged.limit_m = std::min(most, share * std::max(evaluation.path_length_m, shortest_walk));
  judged.diverged = !(judged.error_m <= judged.limit_m);  // a NaN has diverged
  return judged;
}

}  // namespace kilvo::lab
