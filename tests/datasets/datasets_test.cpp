// The public datasets' formats: types, topics, two-feet message, acceleration in g, stamps at the scan's end. A short walk of the simulator
// is written as each of them has it, with its mounts and its camera, and run with the configuration that is shipped for it.
#include <cstring>
#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "lab/evaluation/evaluate.hpp"
#include "lab/messages/encode.hpp"
#include "lab/messages/ros_types.hpp"
#include "lab/messages/wire_writer.hpp"
#include "lab/recordings/rosbag1_writer.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/simulator.hpp"
#include "tests/cli/program.hpp"

namespace kilvo::stories {
namespace datasets_test {

using lab::Encoding;

constexpr double lasts = 6;  // s, of which 3.4 of standing
// Images are rendered with so many times fewer pixels along each side: of their detail nothing is judged here.
constexpr int coarser = 4;

constexpr lab::MessageType livox{"livox_ros_driver/CustomMsg", "e4d6829bdfe657cb6c21a746c86b21a6", R"(Header header
uint64 timebase
uint32 point_num
uint8 lidar_id
uint8[3] rsvd
CustomPoint[] points
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: livox_ros_driver/CustomPoint
uint32 offset_time
float32 x
float32 y
float32 z
uint8 reflectivity
uint8 tag
uint8 line
)"};

template <class T>
void put(std::vector<std::uint8_t>& to, T value) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(&value);
  to.insert(to.end(), bytes, bytes + sizeof value);
}

/// As livox_ros_driver writes it: offsets count from the first point, the stamp is its time.
std::vector<std::uint8_t> as_livox(const LidarScan& scan) {
  const std::int64_t begin = to_ns(scan.t) + scan.points.front().offset_ns;
  std::vector<std::uint8_t> points;
  std::uint8_t line = 0;
  for (const LidarPoint& p : scan.points) {
    put(points, static_cast<std::uint32_t>(to_ns(scan.t) + p.offset_ns - begin));
    for (const float x : {p.x, p.y, p.z}) put(points, x);
    for (const int byte : {static_cast<int>(p.intensity), 0x10, line++ % 4}) points.push_back(static_cast<std::uint8_t>(byte));
  }
  lab::LivoxMessage m;
  m.header = {{}, time_from_ns(begin), "livox_frame"};
  m.timebase = static_cast<std::uint64_t>(begin);
  m.point_num = static_cast<std::uint32_t>(scan.points.size());
  m.points = {points, lab::LivoxPoint::wire_bytes};
  return write_message(m, Encoding::ros1);
}

/// As velodyne_pointcloud writes it, except that the stamp is the scan's end: 22 bytes for each point, `time` in seconds.
std::vector<std::uint8_t> as_velodyne(const LidarScan& scan, Duration period) {
  constexpr std::uint8_t uint16 = 4, float32 = 7;
  std::vector<std::uint8_t> data;
  std::uint16_t ring = 0;
  for (const LidarPoint& p : scan.points) {
    for (const float x : {p.x, p.y, p.z, p.intensity, static_cast<float>(1e-9 * p.offset_ns)}) put(data, x);
    put(data, static_cast<std::uint16_t>(ring++ % 16));
  }
  lab::PointCloud2Message m;
  m.header = {{}, scan.t + period, "velodyne"};
  m.width = static_cast<std::uint32_t>(scan.points.size());
  m.point_fields = {{"x", 0, float32},          {"y", 4, float32},     {"z", 8, float32},
                    {"intensity", 12, float32}, {"time", 16, float32}, {"ring", 20, uint16}};
  m.point_step = 22;
  m.row_step = static_cast<std::uint32_t>(data.size());
  m.data = lab::Numbers<std::uint8_t>::of(data);
  return write_message(m, Encoding::ros1);
}

/// The picture with `coarser` times as many pixels along each side, between which it is linear.
Image magnified(const Image& small) {
  Image out;
  out.width = small.width * coarser;
  out.height = small.height * coarser;
  out.channels = small.channels;
  out.pixels.resize(static_cast<std::size_t>(out.width * out.height * out.channels));
  const auto place = [](int i, int most) {
    const double x = std::clamp((i + 0.5) / coarser - 0.5, 0.0, most - 1.001);
    return std::pair(static_cast<int>(x), x - std::floor(x));
  };
  const auto at = [&](int u, int v, int c) {
    return static_cast<double>(small.pixels[static_cast<std::size_t>((v * small.width + u) * small.channels + c)]);
  };
  std::size_t next = 0;
  for (int v = 0; v < out.height; ++v) {
    const auto [y, fy] = place(v, small.height);
    for (int u = 0; u < out.width; ++u) {
      const auto [x, fx] = place(u, small.width);
      for (int c = 0; c < out.channels; ++c) {
        const double upper = (1 - fx) * at(x, y, c) + fx * at(x + 1, y, c), lower = (1 - fx) * at(x, y + 1, c) + fx * at(x + 1, y + 1, c);
        out.pixels[next++] = static_cast<std::uint8_t>(std::lround((1 - fy) * upper + fy * lower));
      }
    }
  }
  return out;
}

struct Dataset {
  std::string name;      // of its configuration
  std::string modality;  // with all its sensors
  bool in_g, velodyne, camera;
};

/// The simulated robot with the mounts and the camera that the configuration has.
lab::SimulatorConfig robot_of(const lab::Settings& settings, const Dataset& dataset) {
  lab::SimulatorConfig out;
  out.duration = lasts;
  out.use[static_cast<std::size_t>(Sensor::camera)] = dataset.camera;
  out.shape.sole_depth = settings.robot.legs.sole_offset;
  out.shape.T_imu_lidar = settings.robot.lidar.T_imu_lidar;
  if (dataset.velodyne) {
    out.shape.T_torso_lidar = SE3(SO3(), {0, 0, 0.5});
    out.lidar.scan = lab::LidarModel::Scan::lines_16;
  }
  if (!dataset.camera) return out;
  const CameraMount& camera = settings.robot.camera;
  out.camera.width = camera.width / coarser;
  out.camera.height = camera.height / coarser;
  out.camera.fx = camera.fx / coarser;
  out.camera.fy = camera.fy / coarser;
  out.camera.cx = (camera.cx + 0.5) / coarser - 0.5;
  out.camera.cy = (camera.cy + 0.5) / coarser - 0.5;
  std::copy_n(camera.distortion.begin(), 4, out.camera.distortion.begin());
  out.camera.T_torso_camera = out.shape.T_torso_imu() * camera.T_imu_camera;
  return out;
}

/// Positions and velocities of the feet's links in the frame of the messages, left and right.
JointSample two_feet(const lab::Walk& walk, double t, Time stamp, const SE3& T_imu_feet) {
  JointSample out;
  out.t = stamp;
  const auto foot_at = [&](lab::Side side, double s) {
    return Eigen::Vector3d((walk.imu(s) * T_imu_feet).inverse() * walk.foot(side, s).p);
  };
  for (const lab::Side side : {lab::Side::left, lab::Side::right}) {
    constexpr double dt = 5e-4;
    const Eigen::Vector3d p = foot_at(side, t), v = (foot_at(side, t + dt) - foot_at(side, t - dt)) / (2 * dt);
    out.position.insert(out.position.end(), p.begin(), p.end());
    out.velocity.insert(out.velocity.end(), v.begin(), v.end());
  }
  return out;
}

class PublicDataset : public testing::TestWithParam<Dataset> {
 protected:
  void record(const lab::Settings& settings) {
    lab::Simulator simulator(*lab::find_scenario("room"), robot_of(settings, GetParam()));
    lab::Rosbag1Writer bag(folder_ / "recording.bag");
    std::array<std::uint32_t, sensor_count> ids{};
    for (const Sensor s : {Sensor::imu, Sensor::legs, Sensor::lidar, Sensor::camera}) {
      if (s == Sensor::camera && !GetParam().camera) continue;
      const bool custom = s == Sensor::lidar && !GetParam().velodyne;
      ids[static_cast<std::size_t>(s)] = bag.add_connection(settings.topic(s), custom ? livox : lab::written_type(s));
    }
    while (auto m = simulator.next())
      bag.write(ids[static_cast<std::size_t>(sensor_of(*m))], simulator.arrived(), encoded(*m, simulator, settings));
    bag.close();
    for (int i = 0; i < static_cast<int>(1000 * lasts); ++i)
      truth_.push_back({simulator.start() + std::chrono::milliseconds(i), simulator.walk().imu(1e-3 * i)});
  }

  std::vector<std::uint8_t> encoded(Measurement& m, const lab::Simulator& simulator, const lab::Settings& settings) const {
    if (auto* imu = std::get_if<ImuSample>(&m)) {
      if (GetParam().in_g) imu->accel /= standard_gravity;
    } else if (const auto* joints = std::get_if<JointSample>(&m)) {
      return lab::encode(two_feet(simulator.walk(), simulator.seconds_of(simulator.measured()), joints->t, settings.robot.legs.T_imu_feet),
                         "");
    } else if (auto* scan = std::get_if<LidarScan>(&m)) {
      return GetParam().velodyne ? as_velodyne(*scan, std::chrono::milliseconds(100)) : as_livox(*scan);
    } else if (auto* camera = std::get_if<CameraImage>(&m)) {
      camera->image = magnified(camera->image);
    }
    return lab::encode(m, "");
  }

  TemporaryFolder folder_;
  std::vector<lab::StampedPose> truth_;
};

TEST_P(PublicDataset, RunsWithAllItsSensors) {
  const std::string config = std::string(KILVO_SOURCE_DIR) + "/config/datasets/" + GetParam().name + ".yaml";
  EXPECT_EQ(kilvo({"config", "check", config}).code, 0);
  const lab::Settings settings = lab::load_settings(config);
  record(settings);
  const Finished done = kilvo({"run", folder_ / "recording.bag", "--config", config, "--out", folder_ / "out"});
  ASSERT_EQ(done.code, 0) << done.err;
  const auto summary = nlohmann::json::parse(read_text(folder_ / "out/summary.json"));
  // Images begin with the second sweep, and a narrow view of coarse images has stretches with too few points.
  EXPECT_GT(summary["modality_seconds"].value(GetParam().modality, 0.0), 0.6 * lasts) << summary["modality_seconds"];
  EXPECT_FALSE(summary["diverged"]);
  for (const auto& [sensor, messages] : summary["messages"].items()) {
    std::uint64_t lost = 0;
    for (const auto& [cause, n] : messages["dropped"].items()) lost += n.get<std::uint64_t>();
    EXPECT_LE(lost, 2U) << sensor << messages;
  }
  EXPECT_GE(summary["contact_events"]["left"].get<int>() + summary["contact_events"]["right"].get<int>(), 3);
  // Clocks and mounts are as configured: an offset of the scans by a period, or accelerations in another unit, would cost centimetres.
  const auto errors = lab::evaluate(lab::read_tum(folder_ / "out/sweeps.tum"), truth_, lab::Alignment::se3);
  EXPECT_LT(errors.ate_rmse_m, 0.005);
  EXPECT_LT(errors.rotation_rmse_deg, 1);  // of so short a way the alignment leaves much open
}

INSTANTIATE_TEST_SUITE_P(Each, PublicDataset,
                         testing::Values(Dataset{"kilvo_r", "KILV", true, false, true}, Dataset{"kilvo_h", "KILV", true, false, true},
                                         Dataset{"hr2_kilo", "KIL", true, false, false}, Dataset{"liko", "KIL", false, true, false}),
                         [](const auto& each) { return each.param.name; });

}  // namespace datasets_test
}  // namespace kilvo::stories
