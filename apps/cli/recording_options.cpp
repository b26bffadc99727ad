#include "apps/cli/recording_options.hpp"

#include <algorithm>

namespace kilvo::cli {

lab::RecordingOptions recording_options(const RunOptions& options, const lab::Settings& settings, const std::vector<Sensor>& used) {
  const Robot& robot = settings.robot;
  const double rates[] = {robot.imu.rate, robot.legs.rate, robot.lidar.rate, robot.camera.rate};
  const double offsets[] = {robot.imu.time_offset, robot.legs.time_offset, robot.lidar.time_offset, robot.camera.time_offset};
  lab::RecordingOptions out;
  for (const Sensor sensor : used) {
    const auto i = static_cast<std::size_t>(sensor);
    out[sensor] = {true, settings.topic(sensor), rates[i], offsets[i]};
  }
  const bool with_legs = std::ranges::find(used, Sensor::legs) != used.end();
  if (with_legs && settings.leg_clock.clock != "stamp") out.leg_clock.emplace(settings.leg_clock, settings.robot);
  out.no_deskew = options.no_deskew;
  out.with_colours = options.with_map;
  out.start = options.start;
  out.duration = options.duration;
  return out;
}

}  // namespace kilvo::cli
