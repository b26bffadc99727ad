// Why the results of a run are not to be used.
#pragma once

#include <string>

#include "apps/cli/run_summary.hpp"
#include "kilvo/estimator/estimator.hpp"
#include "lab/recordings/recording_source.hpp"

namespace kilvo::cli {

/// Empty: nothing speaks against them. Sensors that are not read from `source` are not missed.
std::string failure_of(const RunSummary& run_summary, const Estimator& estimator, const lab::RecordingSource& source);

}  // namespace kilvo::cli
