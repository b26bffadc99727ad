#include "lab/simulation/rough_record.hpp"

#include <fmt/format.h>

#include "lab/simulation/units.hpp"

namespace kilvo::lab {
namespace {

// Numbers in brackets; a matrix row by row.
template <class Numbers>
std::string listed(const Numbers& numbers) {
  std::string out;
  for (const double x : numbers) out += fmt::format("{}{:.7g}", out.empty() ? "" : ", ", x);
  return "[" + out + "]";
}
std::string listed(const Eigen::Matrix3d& m) { return listed(m.transpose().reshaped()); }

std::string imu_lines(const SimulatorConfig& config, const ImuErrors& e) {
  return fmt::format(
      "imu:\n  gyro_matrix: {}  # shown = matrix * true\n  accel_matrix: {}\n  g_sensitivity: {}  # rad/s per m/s^2\n"
      "  gyro_warming: {}  # rad/s, of the bias, with this time constant, s:\n  warm_up: {}\n  accel_warming: {}  # m/s^2\n"
      "  accel_range: {:.7g}  # m/s^2\n  vibration: {:.7g}  # m/s^2 rms on each axis while walking\n",
      listed(e.gyro), listed(e.accel), listed(e.g_sensitivity), listed(e.gyro_warming), e.warm_up, listed(e.accel_warming),
      config.imu.accel_range, config.wear.vibration);
}

std::string lidar_lines(const LidarErrors& e) {
  return fmt::format(
      "lidar:\n  incidence_bias: {:.7g}  # m at 75 degrees, as 1 / cos - 1\n  material_bias: {:.7g}  # m at the most\n"
      "  range_noise: [{:.7g}, {:.7g}]  # m, sigma, of strong and of weak echoes\n  tail: {:.7g}  # share with 5 sigma\n"
      "  mixed: {:.7g}  # share of points at edges\n  dropout: {:.7g}  # share\n  arms: {:.7g}  # share\n",
      e.incidence_bias, e.material_bias, e.least_sigma, e.most_sigma, e.tail, e.mixed, e.dropout, e.arms);
}

std::string legs_lines(const SimulatorConfig& config, const Simulator& simulator) {
  const WearModel& w = config.wear;
  std::string zeros;
  for (std::size_t i = 0; i < joint_names().size(); ++i)
    zeros += fmt::format("{}{}: {:.7g}", i == 0 ? "" : ", ", joint_names()[i], simulator.joint_zeros()[i]);
  return fmt::format(
      "legs:\n  zeros: {{{}}}  # rad, shown minus true\n  thigh: {:.7g}  # m\n  shin: {:.7g}\n  backlash_deg: {:.7g}\n"
      "  flex_deg: {:.7g}  # under 100 N m\n  velocity_lag: {:.7g}  # s\n  stamp_jitter: {:.7g}  # s\n"
      "  lost: {:.7g}  # share\n  repeated: {:.7g}\n",
      zeros, simulator.walk().shape().thigh, simulator.walk().shape().shin, w.backlash / degree, w.flex / degree, w.velocity_lag,
      w.stamp_jitter, w.lost + w.legs_lost, w.repeated + w.legs_repeated);
}

std::string camera_lines(const SimulatorConfig& config, const CameraErrors& e) {
  return fmt::format(
      "camera:\n  vignetting: {:.7g}  # share, in the corners\n  gamma: {:.7g}\n  white_balance: {:.7g}  # share that red and blue drift\n"
      "  readout_time: {:.7g}  # s\n  exposure: {:.7g}  # s, in the mean\n",
      e.vignetting, e.gamma, e.white_balance, e.readout, config.camera.exposure);
}

}  // namespace

std::string rough_record(int level, const RoughParts& parts, const Simulator& simulator) {
  const SimulatorConfig& config = simulator.config();
  std::string out =
      fmt::format("# kilvo simulate --rough: what no setting says. The settings' true values are in truth.yaml.\nlevel: {}\nparts: [{}]\n",
                  level, names_of(parts));
  if (config.errors.imu) out += imu_lines(config, *config.errors.imu);
  if (config.errors.lidar) out += lidar_lines(*config.errors.lidar);
  if (parts.legs) out += legs_lines(config, simulator);
  if (config.errors.camera) out += camera_lines(config, *config.errors.camera);
  if (config.errors.objects > 0) out += fmt::format("scene:\n  objects: {}\n", config.errors.objects);
  if (parts.time)
    out += fmt::format("time:\n  jitter: {:.7g}  # s, sigma of the stamps of scans and images\n", config.lidar.delivery.jitter);
  return out;
}

}  // namespace kilvo::lab
