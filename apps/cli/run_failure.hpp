// Why the results of a run are not to be used.
#pragma once

#include <string>

#include "apps/cli/run_summary.hpp"
#include "kilvo/estimator/estimator.hpp"

namespace kilvo::cli {

/// Empty: nothing speaks against them. `with_lidar`: the recording has LiDAR scans.
std::string failure_of(const RunSummary& run_summary, const Estimator& estimator, bool with_lidar);

}  // namespace kilvo::cli
