// A simulated walk, written as a recording with its truth.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "apps/cli/wear_options.hpp"

namespace kilvo::cli {

struct SimulationOptions {
  std::string scenario;            // by name; `kilvo simulate --help` lists them
  std::int64_t seed = 1;           // of furniture, textures and noise
  std::optional<double> duration;  // s; until the walk ends by default
  bool quiet = false;              // no progress
  double stride = 1;               // every step so many times as long as in the scenario
  WearOptions wear{};              // beside that of the scenario
  int rough = 0;                   // level of lab::rough_robot(); 0: the robot is as it is described
  std::string rough_only{};        // parts of that, with commas between; empty: all
  std::string sensors{};           // that are recorded, with commas between; empty: all
  // In place of the scenario's.
  std::optional<int> lidar_points{}, image_width{};  // of a sweep; pixels, with the same field of view
  std::optional<double> lidar_rate{};                // Hz
};

/// Writes recording.bag, gt.tum, contacts.gt.csv, imu_truth.csv, exposure.csv, robot.urdf and config.yaml into `folder`; of a rough robot
/// also truth.yaml (config.yaml with the true values), its truth.urdf, and rough.yaml (what no setting says). Returns the seconds
/// simulated. Throws UsageError for options that make no sense, lab::OutputError when the folder cannot be written.
double simulate_into(const std::filesystem::path& folder, const SimulationOptions& options);

/// One line for each scenario.
std::string list_of_scenarios();

}  // namespace kilvo::cli
