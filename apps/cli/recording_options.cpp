#include "apps/cli/recording_options.hpp"

#include "lab/settings/leg_joints.hpp"

namespace kilvo::cli {

lab::RecordingOptions recording_options(const lab::Settings& settings, const std::vector<Sensor>& used) {
  const auto rates = rates_of(settings.robot), offsets = time_offsets_of(settings.robot);
  lab::RecordingOptions out;
  for (const Sensor sensor : used) out[sensor] = {true, settings.topic(sensor), rates[index_of(sensor)], offsets[index_of(sensor)]};
  out[Sensor::imu].gyro_scale = settings.robot.imu.gyro_scale;
  if (out[Sensor::legs].use) out[Sensor::legs].joints = lab::leg_joints(settings.robot);
  out[Sensor::legs].with_velocities = settings.robot.legs.velocities == "messages";
  if (out[Sensor::legs].use && settings.leg_clock.clock != "stamp") out.leg_clock.emplace(settings.leg_clock, settings.robot);
  out.no_deskew = !settings.clouds.deskew;
  return out;
}

lab::RecordingOptions recording_options(const RunOptions& options, const lab::Settings& settings, const std::vector<Sensor>& used) {
  lab::RecordingOptions out = recording_options(settings, used);
  out.no_deskew |= options.no_deskew;
  out.with_colours = options.with_map;
  out.start = options.start;
  out.duration = options.duration;
  return out;
}

}  // namespace kilvo::cli
