// What a run does about a description that the data contradict: it restarts with the settings that correct it, and without the sensors
// that no setting corrects.
#pragma once

#include <vector>

#include "apps/cli/run_recording.hpp"
#include "lab/doctor/description_watch.hpp"
#include "lab/settings/settings.hpp"

namespace kilvo::cli {

/// Of the rounds of a run before this one.
struct KnownDescription {
  std::vector<lab::WrongDescription> wrong;
  std::vector<lab::Change> refined;  // settings that calibration.online has changed before the run
  std::vector<lab::Change> mended;   // settings that this round has instead of those
  int round = 1;
  /// The data may still stop the run: as described, and as mended.
  bool is_judged() const { return round == 1 || (round == 2 && !mended.empty()); }
  /// A run with such a description is not to go on. What changes on the way ends it as a failure.
  bool stops(const lab::WrongDescription& found) const { return !found.has_changed && (found.spoils || (round == 1 && found.is_mendable)); }
};

/// Before the first round, where calibration.online asks for it: what the first minute of the recording says more exactly than the
/// description does, as by `kilvo calibrate`. Nothing when the description is wrong.
KnownDescription refined(const lab::Settings& settings, const RunOptions& options, const std::filesystem::path& config,
                         const std::vector<Sensor>& used);

/// The next round, after one that `found` stopped. `used`: in the first one.
KnownDescription next_round(KnownDescription known, const std::vector<lab::WrongDescription>& found, const RunOptions& options,
                            const std::filesystem::path& config, const std::vector<Sensor>& used);

/// The settings of this round.
lab::Settings mended(const KnownDescription& known, const RunOptions& options, const std::filesystem::path& config);

/// `used` without the sensors that are described wrongly and not corrected. A mount of the IMU on the robot concerns the legs alone; images
/// need the LiDAR's map. Empty: nothing is left to estimate with.
std::vector<Sensor> sound(const std::vector<Sensor>& used, const KnownDescription& known);

/// "; the results are with lidar.T_imu_lidar.R corrected, of imu, legs alone"
std::string consequence(const KnownDescription& known, const std::vector<Sensor>& used, const std::vector<Sensor>& left);

}  // namespace kilvo::cli
