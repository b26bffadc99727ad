// A recording in; a trajectory, a map and a summary out.
#pragma once

#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "lab/simulation/failures.hpp"

namespace kilvo::cli {

struct RunOptions {
  std::vector<std::string> inputs;  // several are one recording
  std::filesystem::path out;
  std::optional<std::string> config;  // the shipped one of the G1 by default
  std::vector<std::string> overrides;
  std::optional<std::vector<Sensor>> sensors;
  std::vector<lab::Failure> failures;
  double start = 0;                                           // s from the recording's beginning
  double duration = std::numeric_limits<double>::infinity();  // s
  std::optional<std::filesystem::path> map;                   // out/map.ply by default
  bool with_map = true;
  bool mcap = false;               // out/run.mcap too
  std::optional<double> realtime;  // through the live runner, so many times as fast as it was recorded
  bool no_deskew = false;
  bool trust_description = false;  // do not hold the first seconds against it
  int threads = 1;                 // more than one: reading and the map have their own. The results are the same
  bool quiet = false;
};

/// Writes the files of interface.md into options.out. Returns `done` or `run_failed`; everything is written in both cases. Throws, before
/// anything is written, what main() turns into the other exit codes.
int run_recording(const RunOptions& options);

}  // namespace kilvo::cli
