// Everything that a configuration file and `--set` can say, and how it is read. Which keys there are: setting_list.hpp.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <span>
#include <stdexcept>
#include <string>

#include "kilvo/estimator/config.hpp"
#include "kilvo/sensors/measurement.hpp"
#include "kilvo/sensors/robot.hpp"
#include "lab/clocks/leg_clock.hpp"
#include "lab/mapping/map_builder.hpp"
#include "lab/settings/calibration_config.hpp"
#include "lab/settings/cloud_config.hpp"
#include "lab/settings/live_config.hpp"

namespace kilvo::lab {

/// A setting that cannot be used. The text says where (file:line or --set), which key, what is wrong and the nearest valid name.
struct ConfigError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Settings {
  Robot robot;
  std::string urdf_file;                         // absolute; robot.urdf is its content
  std::array<std::string, sensor_count> topics;  // by Sensor; empty: this robot does not have it
  LegClockConfig leg_clock;
  CloudConfig clouds;
  EstimatorConfig estimator;
  MappingConfig mapping;
  CalibrationConfig calibration;
  LiveConfig live;

  std::map<std::string, std::string> given;  // key -> where it was set ("g1.yaml:12"); all others have their defaults

  const std::string& topic(Sensor s) const { return topics[static_cast<std::size_t>(s)]; }
  bool has(Sensor s) const { return !topic(s).empty(); }
};

/// Reads a configuration file, then overrides of the form KEY=VALUE (KEY as in "lidar.voxel_size", VALUE as YAML would have it). Checks
/// each value and what they must satisfy together. Throws ConfigError.
Settings load_settings(const std::filesystem::path& file, std::span<const std::string> overrides = {});

/// The same from text in memory; `name` stands in error messages, and a relative robot.urdf is looked for in `folder`.
Settings parse_settings(const std::string& yaml, const std::string& name, const std::filesystem::path& folder,
                        std::span<const std::string> overrides = {});

/// Throws ConfigError when a key is missing that one of these sensors cannot do without.
void require_complete(const Settings& settings, std::span<const Sensor> used);

}  // namespace kilvo::lab
