// How far an estimate is from the truth: what `kilvo eval` prints.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "lab/evaluation/align.hpp"

namespace kilvo::lab {

/// Errors of the matched poses (see match()), after alignment where that matters. m, s, degrees; rmse is over the matched poses.
struct Evaluation {
  Alignment alignment = Alignment::se3;
  std::size_t estimates = 0;  // poses in the estimate
  std::size_t matches = 0;    // of these, compared with the truth

  double ate_rmse_m = 0;                 // absolute trajectory error: position, after alignment
  double ate_max_m = 0;                  //
  std::optional<double> ate_rmse_yaw_m;  // aligned by position and heading, where that was asked for beside another alignment
  double rotation_rmse_deg = 0;          // angle of R_G^T R_GE R_E

  // Relative error (T_G,i^-1 T_G,j)^-1 (T_E,i^-1 T_E,j): rms of its translation. Nothing when the walk is shorter, or the poses too rare.
  std::optional<double> rte_1m_m;        // j is 1 m of the truth's path after i
  std::optional<double> rte_1m_percent;  // the same over the length actually walked
  std::optional<double> rte_1s_m;        // j is 1 s after i

  // e = R_G,0^T (p_G,N - p_G,0) - R_E,0^T (p_E,N - p_E,0) between the first and the last match; no alignment changes it.
  double e2e_m = 0;         // |e|
  double e2e_z_m = 0;       // its z in the world, signed: (R_G,0 e)_z; positive when the estimate ends too low
  double e2e_length_m = 0;  // | |p_G,N - p_G,0| - |p_E,N - p_E,0| |

  double coverage = 0;        // share (0..1) of the truth's time between matches at most 1 s (or ten median periods) apart
  double duration_s = 0;      // the truth's span of time
  double path_length_m = 0;   // of the truth, from the first match to the last, sampled at 10 Hz: jitter of the truth adds nothing
  double rate_hz = 0;         // of the estimate
  double largest_gap_s = 0;   // between consecutive estimates, matched or not
  double largest_jump_m = 0;  // between consecutive estimates, matched or not
};

/// Throws EvaluationError when fewer than 3 estimates lie within the truth's span of time or a trajectory is not in the order of time.
Evaluation evaluate(std::span<const StampedPose> estimates, std::span<const StampedPose> truth, Alignment alignment);

/// Divergence is judged against truth, not by the program's own word: an error over 1 m or over 5 % of the distance walked (taken as 2 m at
/// least: a robot that stands still is allowed 0.1 m). The error is the larger of the maximum ATE and the end-to-end error.
struct Divergence {
  bool diverged = false;
  double error_m = 0;
  double limit_m = 0;
};
Divergence judge_divergence(const Evaluation& evaluation);

/// One JSON object; keys are the members' names, `align` (se3, yaw, first), `diverged`, `divergence_limit_m`; what is not known is null.
std::string to_json(const Evaluation& evaluation);
/// A few lines for people, ending with a newline.
std::string to_text(const Evaluation& evaluation);

}  // namespace kilvo::lab
