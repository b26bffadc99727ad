// What the checks found wrong: who, what, by how much, on what evidence, and which setting mends it.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "kilvo/sensors/measurement.hpp"

namespace kilvo::lab {

/// A setting and the value that it should have, as YAML.
struct Change {
  std::string key, value;
};

struct Finding {
  Sensor sensor = Sensor::imu;  // the culprit
  std::string cause;            // one word of a fixed list, as "lidar_rotation" (docs/calibration.md)
  std::string text;             // what is wrong, with its size
  std::string evidence;         // what shows it
  std::string remedy;           // what mends it, for a person
  double size = 0;              // in `unit`
  std::string unit;
  std::vector<Change> changes;                     // that mend it in the configuration; empty when it has to be mended elsewhere
  bool fatal = true;                               // a run would be wrong; false: the estimator copes with it
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();  // rad, IMU frame: a mount that is wrong by a rotation
};

/// Adds `later`, which hold where both have a key.
inline void put(std::vector<Change>& changes, const std::vector<Change>& later) {
  for (const Change& c : later) {
    std::erase_if(changes, [&c](const Change& before) { return before.key == c.key; });
    changes.push_back(c);
  }
}

/// Something that was looked at.
struct Check {
  enum class Verdict { good, note, wrong, unknown };
  Sensor sensor = Sensor::imu;
  std::string what;  // "rotation of the LiDAR's mount"
  Verdict verdict = Verdict::unknown;
  std::string detail;    // measured value with its standard deviation, or why it cannot be judged
  bool at_rest = false;  // tells nothing of mounts and clocks
};

struct Diagnosis {
  std::vector<Finding> findings;
  std::vector<Check> checks;
  bool settled = false;                          // each sense that is there moved enough to be judged
  std::array<bool, sensor_count> seems_wrong{};  // and more data would make it sure
  /// Bias of the gyro about the vertical by the turning of soles that stand, rad/s, and its standard deviation: without a LiDAR.
  std::optional<std::pair<double, double>> gyro_bias = std::nullopt;
  bool good() const { return findings.empty(); }
  /// Nothing could be judged at all.
  bool unknown() const;
};

}  // namespace kilvo::lab
