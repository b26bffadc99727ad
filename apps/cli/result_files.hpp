// The files of a run, written as the outputs come.
#pragma once

#include <filesystem>
#include <optional>

#include "apps/cli/csv_file.hpp"
#include "apps/cli/run_summary.hpp"
#include "apps/live/smooth_odometry.hpp"
#include "kilvo/estimator/output.hpp"
#include "lab/evaluation/trajectory_file.hpp"

namespace kilvo::cli {

class ResultFiles {
 public:
  /// Throws lab::OutputError or lab::TrajectoryOutputError, as do write() and close().
  ResultFiles(const std::filesystem::path& folder, double smooth_time);

  /// What every output says, and what only sweeps, images and those with events say: of a live runner they come apart.
  void write_state(const Output& output);
  void write_sweep(const Output& output);
  void write_events(const std::vector<Event>& events);
  /// What the data say against the description, as an event.
  void write_description(Time t, Sensor sensor, bool spoils, double size, const std::string& text);
  void close();

  const RunSummary& run_summary() const { return run_summary_; }

 private:
  void write_full_state(const Output& output);
  void write_modality(const Output& output);
  void write_stages(const Output& output);
  void write_event(Time t, const std::string& sensor, const std::string& reason, double value, std::string text);
  void write_contacts(const Output& output);
  void write_indicators(const Output& output);

  lab::TumWriter odometry_, smooth_, sweeps_;
  CsvFile states_, modality_, timing_, events_;
  std::filesystem::path folder_;
  SmoothOdometry smoothing_;
  std::optional<CsvFile> contacts_;     // from the first leg sample on
  std::optional<CsvFile> degradation_;  // from the first sweep or image on
  std::optional<Modality> last_modality_;
  std::optional<Time> last_state_;
  RunSummary run_summary_;
  std::string line_;  // that is being written
};

}  // namespace kilvo::cli
