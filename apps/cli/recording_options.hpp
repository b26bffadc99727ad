// What of a recording a run reads.
#pragma once

#include "apps/cli/run_recording.hpp"
#include "lab/recordings/recording_source.hpp"
#include "lab/settings/settings.hpp"

namespace kilvo::cli {

/// The whole recording.
lab::RecordingOptions recording_options(const lab::Settings& settings, const std::vector<Sensor>& used);
/// What the options ask for of it.
lab::RecordingOptions recording_options(const RunOptions& options, const lab::Settings& settings, const std::vector<Sensor>& used);

}  // namespace kilvo::cli
