#include "tests/cli/small_recording.hpp"

#include "lab/recordings/recording_writer.hpp"
#include "lab/simulation/analytic_room.hpp"

namespace kilvo::stories {

SmallWalk small_walk(double seconds) {
  lab::AnalyticRoomConfig config;
  config.duration = seconds;
  config.points_per_scan = 4000;
  lab::AnalyticRoom room(config);
  SmallWalk walk;
  while (auto measurement = room.next()) walk.measurements.push_back(*std::move(measurement));
  for (Time t = room.start(); t <= room.start() + from_seconds(seconds); t += std::chrono::milliseconds(1))
    walk.truth.push_back({t, room.truth(t)});
  return walk;
}

void write_recording(const std::filesystem::path& path, const std::vector<Measurement>& measurements) {
  lab::RecordingWriter writer(path, {"/imu", "/joint_states", "/points", "/image"});
  Time last{};
  for (const Measurement& m : measurements) {
    Time recorded = stamp_of(m);
    if (std::holds_alternative<LidarScan>(m)) recorded += std::chrono::milliseconds(100);
    last = std::max(last, recorded);
    writer.write(m, last);
  }
  writer.close();
}

std::string small_config() {
  return "imu:\n"
         "  topic: /imu\n"
         "lidar:\n"
         "  topic: /points\n"
         "  T_imu_lidar:\n"
         "    p: [-0.011, -0.02329, 0.04412]\n"
         "    R: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n";
}

}  // namespace kilvo::stories
