// Why the results of a run are not to be used.
#pragma once

#include <string>

#include "apps/cli/run_summary.hpp"
#include "kilvo/estimator/estimator.hpp"

namespace kilvo::cli {

/// Empty: nothing speaks against them. `with_lidar`, `with_legs`: the recording has LiDAR scans, messages of the legs.
std::string failure_of(const RunSummary& run_summary, const Estimator& estimator, bool with_lidar, bool with_legs);

}  // namespace kilvo::cli
