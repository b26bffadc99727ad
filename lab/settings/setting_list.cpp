#include "lab/settings/setting_list.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <tuple>

namespace kilvo::lab {
namespace {

class Lister {
 public:
  explicit Lister(std::vector<Setting>& out) : out_(out) {}

  /// All fields of a struct, or those that `keep` chooses by name.
  template <class Config, class Keep>
  void fields(const std::string& section, Config& config, Keep keep) {
    std::apply([&](const auto&... field) { (add_field(section, config, field, keep), ...); }, Config::fields());
  }
  template <class Config>
  void fields(const std::string& section, Config& config) {
    fields(section, config, [](std::string_view) { return true; });
  }

  /// A setting that no default can be given for.
  void own(std::string key, SettingValue value, std::string_view unit, std::string_view meaning) {
    out_.push_back({std::move(key), value, unit, meaning, false});
  }
  void pose(const std::string& key, SE3& T, std::string_view meaning_p, std::string_view meaning_R) {
    own(key + ".p", &T.p, "m", meaning_p);
    own(key + ".R", &T.R, "-", meaning_R);
  }

 private:
  template <class Config, class Field, class Keep>
  void add_field(const std::string& section, Config& config, const Field& field, Keep keep) {
    if (!keep(field.name)) return;
    out_.push_back({fmt::format("{}.{}", section, field.name), &(config.*field.member), field.unit, field.meaning});
  }

  std::vector<Setting>& out_;
};

// The intrinsics stand in CameraMount::fields(), but their zeros are no defaults.
void forget_defaults_of_intrinsics(std::vector<Setting>& list) {
  constexpr std::string_view intrinsics[] = {"camera.width", "camera.height", "camera.fx", "camera.fy", "camera.cx", "camera.cy"};
  for (Setting& s : list) {
    if (std::find(std::begin(intrinsics), std::end(intrinsics), s.key) != std::end(intrinsics)) s.has_default = false;
  }
}

// What users change; all others that have a default are advanced.
constexpr std::string_view common[] = {"imu.rate",        "imu.gyro_noise",   "imu.accel_noise",   "legs.type",
                                       "legs.rate",       "legs.time_offset", "lidar.rate",        "lidar.time_offset",
                                       "lidar.min_range", "lidar.max_range",  "lidar.range_noise", "lidar.voxel_size",
                                       "camera.rate",     "camera.model",     "camera.distortion", "camera.time_offset",
                                       "map.radius",      "map.resolution",   "estimator.threads", "estimator.smooth_time"};

void mark_common(std::vector<Setting>& list) {
  for (Setting& s : list) s.advanced = s.has_default && std::find(std::begin(common), std::end(common), s.key) == std::end(common);
}

}  // namespace

std::vector<Setting> list_settings(Settings& s) {
  std::vector<Setting> out;
  Lister list(out);
  const auto topic = [&s](Sensor sensor) { return &s.topics[static_cast<std::size_t>(sensor)]; };
  // The process noise stands in one struct, but each density belongs to the sensor whose section a user would look in.
  const auto of_feet = [](std::string_view name) { return name.starts_with("foot_"); };
  const auto of_camera = [](std::string_view name) { return name.starts_with("exposure_"); };
  Robot& robot = s.robot;
  ProcessNoise& noise = s.estimator.noise;

  list.own("robot.urdf", &s.urdf_file, "-",
           "URDF file of the robot, relative to the file that names it; only links and joints are read, no meshes");
  list.own("robot.feet", &robot.feet, "m",
           "the two feet: name (left, right), link of the URDF, sole: corner points of the sole in that link");
  list.own("robot.locked_joints", &robot.locked_joints, "-", "joints between IMU and feet that do not move and are not measured");
  list.own("robot.joints", &robot.joints, "-",
           "joints of the URDF whose value in the messages differs: JOINT: {from: its name there, sign: -1 where it turns the other way, "
           "zero: added, rad}");

  list.own("imu.topic", topic(Sensor::imu), "-", "topic of the IMU");
  list.own("imu.T_link_imu.link", &robot.imu.link, "-", "link of the URDF that the IMU is fixed to");
  list.pose("imu.T_link_imu", robot.imu.T_link_imu, "position of the IMU in that link", "rotation from the IMU to that link, row by row");
  list.fields("imu", robot.imu);
  list.fields("imu", noise, [&](std::string_view name) { return !of_feet(name) && !of_camera(name); });

  list.own("legs.topic", topic(Sensor::legs), "-", "topic of the joint encoders, or of the feet");
  list.pose("legs.T_imu_feet", robot.legs.T_imu_feet, "two-feet message: its frame's origin in the IMU frame",
            "two-feet message: rotation from its frame to the IMU, row by row");
  list.fields("legs", robot.legs);
  list.fields("legs", s.leg_clock);
  list.fields("legs", s.estimator.legs);
  list.fields("legs", noise, of_feet);

  list.own("lidar.topic", topic(Sensor::lidar), "-", "topic of the LiDAR");
  list.pose("lidar.T_imu_lidar", robot.lidar.T_imu_lidar, "position of the LiDAR in the IMU frame",
            "rotation from the LiDAR to the IMU, row by row");
  list.fields("lidar", robot.lidar);
  list.fields("lidar", s.clouds);
  list.fields("lidar", s.estimator.lidar);

  list.own("camera.topic", topic(Sensor::camera), "-", "topic of the camera; the same with /compressed at its end is found as well");
  list.pose("camera.T_imu_camera", robot.camera.T_imu_camera, "position of the camera in the IMU frame",
            "rotation from the camera's optical frame (z forward, x right, y down) to the IMU, row by row");
  list.fields("camera", robot.camera);
  list.fields("camera", s.estimator.vision);
  list.fields("camera", noise, of_camera);

  list.fields("map", s.estimator.map);
  list.fields("map", s.mapping);
  list.fields("map.visual", s.estimator.visual_map);

  list.fields("estimator", s.estimator);
  list.fields("estimator.initial", s.estimator.initial);
  list.fields("estimator.update", s.estimator.update);
  list.fields("calibration", s.calibration);
  list.fields("live", s.live);
  forget_defaults_of_intrinsics(out);
  mark_common(out);
  return out;
}

}  // namespace kilvo::lab
