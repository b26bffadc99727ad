// Which figures a run gives. Each function returns those whose data exist, and none otherwise.
#pragma once

#include <optional>
#include <vector>

#include "lab/evaluation/align.hpp"
#include "lab/evaluation/contacts.hpp"
#include "lab/evaluation/evaluate.hpp"
#include "lab/report/figure.hpp"
#include "lab/report/run_files.hpp"

namespace kilvo::lab {

/// An estimated way, as even in time as there is one, and what is known of the truth at its stamps.
struct Way {
  std::vector<StampedPose> poses;  // sweeps, and the odometry at 20 Hz wherever there are none for a quarter of a second
  bool of_sweeps = false;       // at least 98 % of the time after the first sweep: then `evaluation` is of the sweeps, else of the odometry
  std::vector<PosePair> pairs;  // empty without truth
  std::optional<Evaluation> evaluation;
};

Way way_of(const RunFiles& run);
/// The same with the truth beside it; throws EvaluationError when they do not overlap.
Way way_of(const RunFiles& run, std::span<const StampedPose> truth);

/// A point of a way in the estimate's world: s, m.
struct TimedPoint {
  double t = 0;
  Eigen::Vector3d p;
};

/// The estimate, and the truth laid on it by least squares.
struct Curves {
  std::vector<TimedPoint> estimate, truth;
};
Curves curves_of(const TimeBase& time, const Way& way);

using Figures = std::vector<Json>;

Figures path_figures(const TimeBase& time, const Way& way);
Figures error_figures(const TimeBase& time, const Way& way, const std::vector<StateRow>& states);
Figures state_figures(const TimeBase& time, const std::vector<StateRow>& states, std::span<const StampedPose> truth, const Way& way);
Figures contact_figures(const TimeBase& time, const std::vector<ContactRow>& contacts, std::span<const ContactSample> truth,
                        const std::optional<ContactEvaluation>& evaluation);
Figures modality_figures(const TimeBase& time, const RunFiles& run);
Figures rate_figures(const TimeBase& time, const RunFiles& run);
Figures stage_figures(const TimeBase& time, const std::vector<StageRow>& timing);
Figures map_figures(const TimeBase& time, const RunFiles& run, const Way& way);
Figures summary_figures(const Json& summary);

/// The robot at up to 1500 times, for playback: {t: [s], joints: points of one leg, p: [[x, y, z, ... of the left leg, then the right, in
/// the world, cm]], on: [bit 0 left, bit 1 right]}; null when it is not known.
Json playback_of(const TimeBase& time, const RunFiles& run);

/// The numbers on top: {label, value, unit, note, bad}.
Json headlines(const RunFiles& run, const Way& way, const std::optional<ContactEvaluation>& contacts);

}  // namespace kilvo::lab
