#include "lab/simulation/rough.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <numbers>
#include <stdexcept>

#include "lab/simulation/random.hpp"
#include "lab/simulation/units.hpp"

namespace kilvo::lab {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double g = 9.80665;  // m/s^2

struct Named {
  std::string_view name;
  bool RoughParts::*part;
};
constexpr Named table[] = {{"lidar", &RoughParts::lidar}, {"scene", &RoughParts::scene},   {"imu", &RoughParts::imu},
                           {"legs", &RoughParts::legs},   {"camera", &RoughParts::camera}, {"mount", &RoughParts::mount},
                           {"time", &RoughParts::time}};

enum RoughStream : std::uint8_t { imu_stream = 50, camera_stream, mount_stream };

// Draws of one part at one level.
struct Draw {
  int level;
  Random random;

  double pick(double kept_well, double badly) const { return level == 1 ? kept_well : badly; }
  double within(double most) { return random.uniform(-most, most); }
  /// Of either sign, at least half of it: no seed is spared.
  double about(double most) { return random.uniform(0.5, 1) * (random.uniform() < 0.5 ? -most : most); }
  Vector3d direction() { return random.gaussian3().normalized(); }
  /// Another pose, turned and moved by that much into any direction.
  SE3 off(const SE3& T, double angle, double distance) {
    const SO3 turn = SO3::Exp(angle * direction());
    return {T.R * turn, T.p + distance * direction()};
  }
};

void make_imu_rough(Draw d, RoughRobot& robot) {
  ImuModel& imu = robot.truth.imu;
  ImuErrors& e = robot.truth.errors.imu.emplace();
  // Data sheets of MEMS units without factory calibration: 0.2 to 1 % of scale, 0.1 to 0.5 degrees between the axes.
  const double scale = d.pick(0.002, 0.006), skew = d.pick(0.15, 0.5) * degree;
  // 0.1 degrees/s per g is usual, 1 is bad.
  const double pulled = d.pick(0.0005, 0.002);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      e.accel(i, j) += i == j ? d.about(scale) : d.within(skew);
      e.gyro(i, j) += i == j ? d.about(scale) : d.within(skew);
      e.g_sensitivity(i, j) = d.within(pulled);
    }
  }
  // A board warms by 20 to 30 K in its first minutes; biases drift by about 0.003 degrees/s and 0.05 mg per K, three times that when bad.
  e.gyro_warming = d.pick(0.001, 0.004) * d.direction();
  e.accel_warming = d.pick(0.015, 0.06) * d.direction();
  // Data sheets state the noise of the best units.
  imu.gyro_noise *= d.pick(1.5, 3);
  imu.accel_noise *= d.pick(1.5, 3);
  // Left as it powers up the range of many units is 2 g; impacts of walking reach that.
  imu.accel_range = d.pick(16, 2) * g;
  // Gears and fans shake the housing while the robot walks.
  robot.truth.wear.vibration = std::max(robot.truth.wear.vibration, d.pick(0.3, 1.5));
}

void make_lidar_rough(Draw d, RoughRobot& robot) {
  LidarErrors& e = robot.truth.errors.lidar.emplace();
  e.incidence_bias = d.pick(0.008, 0.020);
  e.material_bias = d.pick(0.005, 0.015);
  e.least_sigma = d.pick(0.012, 0.020);
  e.most_sigma = d.pick(0.025, 0.040);
  e.tail = d.pick(0.01, 0.03);
  e.dropout = d.pick(0.02, 0.08);
  e.mixed = 0.4;
  e.arms = d.pick(0.005, 0.02);
  e.seed = robot.truth.seed;
}

// Models of wear that the walk has already stay if they are worse.
void make_legs_rough(const Draw& d, RoughRobot& robot) {
  WearModel& wear = robot.truth.wear;
  const auto at_least = [](double& value, double least) { value = std::max(value, least); };
  at_least(wear.zero_offset, d.pick(0.2, 0.6) * degree);  // zeros are set by hand against a stop
  at_least(wear.backlash, d.pick(0.1, 0.3) * degree);     // of a planetary gear, new and worn
  at_least(wear.flex, d.pick(0.2, 0.6) * degree);         // gears and links under 100 N m
  at_least(wear.link_length, d.pick(0.003, 0.01));        // castings and pads against the drawing
  at_least(wear.velocity_lag, d.pick(0.002, 0.004));      // the drive filters its velocity
  at_least(wear.stamp_jitter, d.pick(0.0002, 0.0006));    // stamped by a program, not by the encoder
  at_least(wear.legs_lost, d.pick(0.002, 0.01));          // UDP
  at_least(wear.legs_repeated, d.pick(0.001, 0.003));     // the sender polls faster than the drives answer
  for (SimulatorConfig* config : {&robot.truth, &robot.known}) {
    config->joints.delivery.rate = std::min(config->joints.delivery.rate, 500.0);  // as unitree_sdk2 sends them
  }
}

void make_camera_rough(Draw d, RoughRobot& robot) {
  CameraModel &camera = robot.truth.camera, &known = robot.known.camera;
  // A wide lens, calibrated with a board by hand: its distortion to some percent, its focal length to some tenths of one.
  const double tangential = d.pick(0.0003, 0.0008), distortion = d.pick(0.02, 0.05), focal = d.pick(0.002, 0.008);
  known.distortion = {-0.3, 0.1, d.about(tangential), d.about(tangential)};
  for (std::size_t i = 0; i < known.distortion.size(); ++i) camera.distortion[i] = known.distortion[i] * (1 + d.about(distortion));
  const double longer = 1 + d.about(focal);
  camera.fx *= longer;
  camera.fy *= longer;
  // Exposed for a room, not for sunlight: blurred while the robot turns. Half the range is left for what is bright.
  camera.exposure = d.pick(0.004, 0.007);
  camera.gain = 0.5 / camera.exposure;
  camera.pixels_per_sample = 1;
  CameraErrors& e = robot.truth.errors.camera.emplace();
  e.vignetting = d.pick(0.15, 0.35);
  e.gamma = 2.2;
  e.white_balance = d.pick(0.03, 0.08);
  for (double& phase : e.phases) phase = d.random.uniform(0, 2 * std::numbers::pi);
  e.readout = d.pick(0, 0.015);  // level 1: global shutter
}

// Holes with play, brackets bent by a fall; the description has the drawing.
void mount_roughly(Draw d, RoughRobot& robot) {
  SimulatorConfig& truth = robot.truth;
  BipedShape& shape = truth.shape;
  const SE3 T_torso_imu = shape.T_torso_imu(), T_imu_camera = T_torso_imu.inverse() * truth.camera.T_torso_camera;
  shape.T_imu_lidar = d.off(shape.T_imu_lidar, d.pick(0.1, 0.5) * degree, d.pick(0.002, 0.008));
  const SE3 camera = d.off(T_imu_camera, d.pick(0.2, 0.6) * degree, d.pick(0.003, 0.008));
  const SE3 imu = d.off(T_torso_imu, d.pick(0.3, 1) * degree, d.pick(0.003, 0.010));
  shape.T_torso_lidar = imu * shape.T_imu_lidar;  // all sit on the head, and the head on the torso
  truth.camera.T_torso_camera = imu * camera;
}

// Each driver stamps when it gets around to it; what arrives later is stamped before that.
void stamp_roughly(const Draw& d, SimulatorConfig& truth) {
  truth.lidar.delivery.offset = d.pick(0.001, 0.006);
  truth.camera.delivery.offset = d.pick(0.002, 0.012);
  truth.joints.delivery.offset = d.pick(0.001, 0.004);
  truth.lidar.delivery.jitter = truth.camera.delivery.jitter = d.pick(0.0003, 0.0015);
  truth.lidar.delivery.latency = 0.015;
  truth.camera.delivery.latency = 0.040;
  truth.joints.delivery.latency = 0.003 + truth.joints.delivery.offset;
}

}  // namespace

std::string names_of(const RoughParts& parts) {
  std::string out;
  for (const Named& n : table) {
    if (parts.*n.part) out += fmt::format("{}{}", out.empty() ? "" : ",", n.name);
  }
  return out;
}

RoughParts rough_parts(std::string_view names) {
  if (names.empty()) return {};
  RoughParts out{false, false, false, false, false, false, false};
  for (bool more = true; more;) {
    const std::string_view name = names.substr(0, names.find(','));
    more = name.size() < names.size();
    names.remove_prefix(more ? name.size() + 1 : name.size());
    const auto* found = std::ranges::find(table, name, &Named::name);
    if (found == std::end(table)) throw std::invalid_argument(fmt::format("no part '{}'; there are {}", name, names_of({})));
    out.*found->part = true;
  }
  return out;
}

RoughRobot rough_robot(const SimulatorConfig& nominal, int level, const RoughParts& parts) {
  RoughRobot robot{nominal, nominal};
  if (level <= 0) return robot;
  const auto draw = [&](std::uint64_t stream) { return Draw{level, Random(nominal.seed, stream)}; };
  if (parts.lidar) make_lidar_rough(draw(0), robot);
  if (parts.scene) robot.truth.errors.objects = level == 1 ? 15 : 40;
  if (parts.imu) make_imu_rough(draw(imu_stream), robot);
  if (parts.legs) make_legs_rough(draw(0), robot);
  if (parts.camera) make_camera_rough(draw(camera_stream), robot);
  if (parts.mount) mount_roughly(draw(mount_stream), robot);
  if (parts.time) stamp_roughly(draw(0), robot.truth);
  return robot;
}

}  // namespace kilvo::lab
