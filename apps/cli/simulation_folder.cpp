#include "apps/cli/simulation_folder.hpp"

#include <fmt/core.h>

#include "apps/cli/csv_file.hpp"
#include "apps/cli/exit_code.hpp"
#include "apps/cli/output_folder.hpp"
#include "apps/cli/progress.hpp"
#include "apps/cli/sensor_choice.hpp"
#include "lab/evaluation/decimal_time.hpp"
#include "lab/evaluation/trajectory_file.hpp"
#include "lab/recordings/recording_writer.hpp"
#include "lab/settings/nearest.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/rough_record.hpp"
#include "lab/simulation/simulator.hpp"

namespace kilvo::cli {
namespace {

namespace fs = std::filesystem;

constexpr double truth_rate = 1000;  // Hz
constexpr double longest = 3600;     // s

const lab::Scenario& scenario_called(const std::string& name) {
  if (const lab::Scenario* found = lab::find_scenario(name)) return *found;
  std::vector<std::string> names;
  for (const lab::Scenario& s : lab::scenarios()) {
    names.push_back(s.name);
    if (!s.also.empty()) names.push_back(s.also);
  }
  throw UsageError(fmt::format("no scenario '{}', nearest is '{}' (kilvo simulate --help lists them)", name, lab::nearest(name, names)));
}

lab::Scenario stretched(lab::Scenario scenario, double stride) {
  if (!(stride > 0 && stride < 100)) throw UsageError("--stride must be above 0 and below 100");
  for (lab::Stage& stage : scenario.stages) {
    stage.gait.forward *= stride;
    stage.gait.left *= stride;
  }
  return scenario;
}

std::string seconds(Time t) {
  std::string out;
  lab::append_seconds(out, t);
  return out;
}

/// Pose and contacts at every millisecond.
void write_walk(const fs::path& folder, const lab::Simulator& simulator) {
  lab::TumWriter poses(folder / "gt.tum");
  CsvFile contacts(folder / "contacts.gt.csv", "t,left,right");
  const lab::Walk& walk = simulator.walk();
  for (std::int64_t i = 0; static_cast<double>(i) <= simulator.duration() * truth_rate; ++i) {
    const double s = static_cast<double>(i) / truth_rate;
    const Time t = simulator.start() + from_seconds(s);
    poses.write({t, walk.imu(s)});
    contacts.write(fmt::format("{},{:d},{:d}", seconds(t), walk.in_contact(lab::Side::left, s), walk.in_contact(lab::Side::right, s)));
  }
  poses.close();
  contacts.close();
}

std::string numbers(std::initializer_list<Eigen::Vector3d> vectors) {
  std::string out;
  for (const Eigen::Vector3d& v : vectors) out += fmt::format(",{:.9g},{:.9g},{:.9g}", v.x(), v.y(), v.z());
  return out;
}

/// Of the last image: a surface that reflects all light has the grey level 255 * total * light. Lamps here do not change.
std::string exposure_line(const lab::Simulator& simulator) {
  const lab::CameraModel& camera = simulator.config().camera;
  const Time t = simulator.measured();
  const double exposure_ms = 1e3 * lab::exposure_at(camera, simulator.seconds_of(t)), gain = 1e-3 * camera.gain;
  return fmt::format("{},{:.6f},{:.6g},{:.9g},1", seconds(t), exposure_ms, gain, exposure_ms * gain);
}

void write_recording(const fs::path& folder, lab::Simulator& simulator, Progress& progress) {
  lab::RecordingWriter recording(folder / "recording.bag", lab::simulated_topics());
  CsvFile imu(folder / "imu_truth.csv", "t,gx,gy,gz,ax,ay,az,bgx,bgy,bgz,bax,bay,baz,vx,vy,vz");
  CsvFile exposure(folder / "exposure.csv", "t,exposure_ms,gain,total,light");
  while (const auto measurement = simulator.next()) {
    recording.write(*measurement, simulator.arrived());
    if (sensor_of(*measurement) == Sensor::imu) {
      const lab::ImuTruth& truth = simulator.imu_truth();
      imu.write(seconds(truth.t) + numbers({truth.gyro, truth.accel, truth.gyro_bias, truth.accel_bias, truth.velocity}));
    } else if (sensor_of(*measurement) == Sensor::camera) {
      exposure.write(exposure_line(simulator));
    }
    progress.update(simulator.seconds_of(simulator.arrived()) / simulator.duration(), [] { return std::string("simulating"); });
  }
  recording.close();
  imu.close();
  exposure.close();
}

lab::RoughParts parts_of(const SimulationOptions& options) {
  if (options.rough < 0 || options.rough > 2) throw UsageError("--rough takes 0, 1 or 2");
  if (options.rough == 0 && !options.rough_only.empty()) throw UsageError("--rough-only needs --rough 1 or 2");
  try {
    return lab::rough_parts(options.rough_only);
  } catch (const std::invalid_argument& error) {
    throw UsageError(fmt::format("--rough-only: {}", error.what()));
  }
}

void resize(lab::SimulatorConfig& config, const SimulationOptions& options) {
  config.lidar.points = options.lidar_points.value_or(config.lidar.points);
  config.lidar.delivery.rate = options.lidar_rate.value_or(config.lidar.delivery.rate);
  lab::CameraModel& camera = config.camera;
  const int width = options.image_width.value_or(camera.width), height = width * camera.height / camera.width;
  const double factor = static_cast<double>(width) / camera.width;
  camera.width = width;
  camera.height = height;
  for (double* size : {&camera.fx, &camera.fy, &camera.cx, &camera.cy, &camera.blur}) *size *= factor;
}

/// The robot, what its user knows of it, and the seed and the end of its walk.
lab::RoughRobot robot_of(const lab::Scenario& scenario, const SimulationOptions& options) {
  lab::SimulatorConfig config = lab::robot_of(scenario);
  config.seed = static_cast<std::uint64_t>(options.seed);
  config.duration = options.duration.value_or(0);
  config.threads = 0;
  if (!options.sensors.empty()) {
    config.use.fill(false);
    for (const Sensor sensor : parse_sensors(options.sensors)) config.use[static_cast<std::size_t>(sensor)] = true;
  }
  resize(config, options);
  lab::RoughRobot robot = lab::rough_robot(config, options.rough, parts_of(options));
  apply(options.wear, robot.truth);
  apply(options.wear, robot.known);
  return robot;
}

void write_rough_truth(const fs::path& folder, const SimulationOptions& options, const lab::Simulator& simulator) {
  lab::SimulatorConfig truth = simulator.config();
  truth.shape = simulator.walk().shape();
  write_text_file(folder / "truth.urdf", lab::urdf_of(truth.shape));
  write_text_file(folder / "truth.yaml", lab::simulated_config(truth, "truth.urdf"));
  write_text_file(folder / "rough.yaml", lab::rough_record(options.rough, parts_of(options), simulator));
}

}  // namespace

std::string list_of_scenarios() {
  std::string out = "Scenarios:\n";
  for (const lab::Scenario& s : lab::scenarios())
    out += fmt::format("  {:<15} {}{}\n", s.name, s.sentence, s.also.empty() ? "" : fmt::format(" (also: {})", s.also));
  return out + "Each begins with 3 s of standing still. The same scenario and seed give the same bytes.";
}

double simulate_into(const fs::path& folder, const SimulationOptions& options) {
  const lab::Scenario scenario = stretched(scenario_called(options.scenario), options.stride);
  if (options.duration && !(*options.duration > 0 && *options.duration <= longest)) {
    throw UsageError(fmt::format("--duration must be above 0 and at most {} seconds", longest));
  }
  if (options.seed < 0) throw UsageError("--seed must be 0 or more");
  const lab::RoughRobot robot = robot_of(scenario, options);
  try {
    lab::Simulator simulator(scenario, robot.truth);
    prepare_folder(folder);
    claim_folder(folder);
    Progress progress(Progress::style_for(options.quiet));
    write_text_file(folder / "robot.urdf", lab::urdf_of(robot.known.shape));
    write_text_file(folder / "config.yaml", lab::simulated_config(robot.known, "robot.urdf"));
    if (options.rough > 0) write_rough_truth(folder, options, simulator);
    write_walk(folder, simulator);
    write_recording(folder, simulator, progress);
    return simulator.duration();
  } catch (const lab::PlanError& error) {
    throw UsageError(fmt::format("{}: {}", scenario.name, error.what()));
  }
}

}  // namespace kilvo::cli
