#include "apps/cli/run_failure.hpp"

#include <fmt/core.h>

namespace kilvo::cli {

std::string failure_of(const RunSummary& run_summary, const Estimator& estimator, const lab::RecordingSource& source) {
  if (run_summary.outputs() == 0) {
    const std::string why = estimator.waiting_for();
    return "nothing was estimated: " + (why.empty() ? "no measurements" : "still " + why);
  }
  if (estimator.statistics().epochs > 1)
    return "the recording's time goes back by more than 2 s: what follows is another recording, and is not in the results (--start and "
           "--duration choose a part)";
  if (!run_summary.absurdity().empty()) return "diverged: " + run_summary.absurdity();
  for (const Event& event : estimator.statistics().events) {
    if (event.reason == Reason::diverged) return "diverged: " + event.detail;
  }
  const bool legs_used = estimator.statistics().sensors[static_cast<std::size_t>(Sensor::legs)].used > 0;
  if (run_summary.sweeps() > 0 || legs_used) {
    // After an outage the robot is found again; but most of such a trajectory is of nothing but the IMU.
    constexpr double at_end = 3;  // s
    if (run_summary.unmeasured_seconds_at_end() > at_end)
      return fmt::format(
          "in the last {:.1f} s neither LiDAR nor legs measured the motion: the positions of that time are integrated from the IMU alone "
          "(--duration leaves them out)",
          run_summary.coasting_seconds_at_end());
    if (2 * run_summary.unmeasured_seconds() <= run_summary.output_seconds()) return "";
    return fmt::format(
        "in {:.1f} of {:.1f} s neither LiDAR nor legs measured the motion: the positions of that time are integrated from the IMU alone",
        run_summary.unmeasured_seconds(), run_summary.output_seconds());
  }
  if (!source.topic(Sensor::lidar).empty()) return "no LiDAR scan could be used";
  return source.topic(Sensor::legs).empty() ? "" : "no message of the legs could be used: the positions are integrated from the IMU alone";
}

}  // namespace kilvo::cli
