// A few seconds in a room whose truth is known, as measurements, as a recording, as a configuration.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "kilvo/sensors/measurement.hpp"
#include "lab/evaluation/trajectory_file.hpp"

namespace kilvo::stories {

struct SmallWalk {
  std::vector<Measurement> measurements;  // in the order of arrival
  std::vector<lab::StampedPose> truth;    // every millisecond
};

/// 1.5 s of standing, then walking: IMU at 200 Hz and scans of 4000 points at 10 Hz.
SmallWalk small_walk(double seconds = 4);

/// Writes a bag with the topics /imu and /points, each measurement recorded when it is complete.
void write_recording(const std::filesystem::path& path, const std::vector<Measurement>& measurements);

/// A configuration for it, complete and good.
std::string small_config();

/// Calls f(ImuSample&, index) for each, with the index among the IMU samples.
template <class F>
void for_each_imu(std::vector<Measurement>& measurements, F&& f) {
  std::size_t i = 0;
  for (Measurement& m : measurements) {
    if (auto* imu = std::get_if<ImuSample>(&m)) f(*imu, i++);
  }
}

template <class F>
void for_each_scan(std::vector<Measurement>& measurements, F&& f) {
  std::size_t i = 0;
  for (Measurement& m : measurements) {
    if (auto* scan = std::get_if<LidarScan>(&m)) f(*scan, i++);
  }
}

}  // namespace kilvo::stories
