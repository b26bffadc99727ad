// What a run gives, as messages of ROS 2 in an MCAP file: Foxglove and Rerun show it along the time.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "kilvo/estimator/output.hpp"
#include "lab/recordings/message_log.hpp"

namespace kilvo::lab {

/// Everything as it was known then (the files of a run are level from the first row on). Frames: `map` is the world, `imu` the IMU. Topics:
/// /kilvo/odometry (each output) and /tf (100 Hz) of the IMU; /kilvo/contacts (each leg sample: position is the clearance in m, velocity
/// how far the foot is from standing still, effort 1 while it stands); /kilvo/cloud (each sweep, thinned); /kilvo/modality and
/// /kilvo/events (when they change); /kilvo/timing (microseconds of each stage).
class RunLog {
 public:
  /// `feet`: their names, left and right. Throws OutputError, as do all functions.
  RunLog(const std::filesystem::path& path, std::array<std::string, 2> feet) : log_(path), feet_(std::move(feet)) {}

  /// In time order: what is of every output, and what is of sweeps and images only, which a live runner gives apart.
  void write_state(const Output& output);
  void write_sweep(const Output& output);
  void close() { log_.close(); }

 private:
  void write_odometry(const Output& output);
  void write_transform(const Output& output);
  void write_contacts(const Contacts& contacts);
  void write_cloud(const Output& output);
  void write_timing(const Output& output);

  MessageLog log_;
  std::array<std::string, 2> feet_;
  std::optional<Time> last_tf_;
  std::optional<Modality> modality_;
};

}  // namespace kilvo::lab
