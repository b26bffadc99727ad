// summary.json: the run in one file.
#pragma once

#include <array>
#include <chrono>
#include <string>
#include <vector>

#include "apps/cli/run_summary.hpp"
#include "apps/live/live_runner.hpp"
#include "kilvo/estimator/output.hpp"
#include "lab/recordings/recording_source.hpp"
#include "lab/settings/settings.hpp"

namespace kilvo::cli {

struct RunFacts {
  std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::now();
  std::string input, config_file;
  std::vector<Sensor> sensors;
  std::vector<std::string> warnings;                   // of the choice of sensors
  std::string failure;                                 // why the run failed; empty when it did not
  std::array<std::uint64_t, sensor_count> withheld{};  // messages, by Sensor: what the user asked to drop
  double wall_seconds = 0;
  std::size_t map_points = 0;
  std::optional<live::LiveStatistics> live;
};

/// All warnings of a run: the choice of sensors, the recording, the estimator.
std::vector<std::string> all_warnings(const RunFacts& facts, const lab::RecordingSource& source, const Statistics& statistics);

/// `levelled`: the event of the world's turn, which is none of the estimator.
std::string summary_json(const RunFacts& facts, const lab::Settings& settings, const lab::RecordingSource& source,
                         const Statistics& statistics, const std::optional<Event>& levelled, const RunSummary& run_summary);

}  // namespace kilvo::cli
