// kilvo demo: simulate a walk through a room, run on it, compare with the truth, show it, say where to look.
#include <fmt/core.h>
#include <memory>

#include "apps/cli/exit_code.hpp"
#include "apps/cli/output_folder.hpp"
#include "apps/cli/progress.hpp"
#include "apps/cli/run_recording.hpp"
#include "apps/cli/verbs.hpp"
#include "lab/evaluation/evaluate.hpp"
#include "lab/evaluation/trajectory_file.hpp"
#include "lab/recordings/recording_writer.hpp"
#include "lab/report/report.hpp"
#include "lab/simulation/analytic_room.hpp"

namespace kilvo::cli {
namespace {

namespace fs = std::filesystem;

struct DemoOptions {
  std::string out = "demo";
  std::uint64_t seed = 1;
  double duration = 20;
  bool quiet = false;
};

constexpr Duration truth_period = std::chrono::milliseconds(1);

std::string config_text(const lab::AnalyticRoomConfig& room) {
  const Eigen::Vector3d& p = room.T_imu_lidar.p;
  return fmt::format(
      "# The sensor head of `kilvo demo`.\n"
      "imu:\n  topic: /imu\n  rate: {}\n"
      "lidar:\n  topic: /points\n  rate: {}\n  T_imu_lidar:\n    p: [{}, {}, {}]\n    R: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n",
      room.imu_rate, room.scan_rate, p.x(), p.y(), p.z());
}

void simulate(const DemoOptions& options, const fs::path& folder) {
  lab::AnalyticRoomConfig config;
  config.seed = options.seed;
  config.duration = options.duration;
  lab::AnalyticRoom room(config);
  Progress progress(Progress::style_for(options.quiet));
  lab::RecordingWriter recording(folder / "recording.bag", {"/imu", "/joint_states", "/points", "/image"});
  while (const auto measurement = room.next()) {
    const double seconds = to_seconds(stamp_of(*measurement) - room.start());
    // A scan is recorded when it is complete.
    const auto* scan = std::get_if<LidarScan>(&*measurement);
    recording.write(*measurement, scan != nullptr ? std::optional(scan->t + from_seconds(1 / config.scan_rate)) : std::nullopt);
    progress.update(seconds / options.duration, [] { return std::string("simulating"); });
  }
  recording.close();
  lab::TumWriter truth(folder / "gt.tum");
  for (Time t = room.start(); t <= room.start() + from_seconds(options.duration); t += truth_period) truth.write({t, room.truth(t)});
  truth.close();
  write_text_file(folder / "config.yaml", config_text(config));
}

void tell(const fs::path& folder, const fs::path& results, const lab::Evaluation& e) {
  const lab::Divergence judged = lab::judge_divergence(e);
  fmt::print("\nA sensor head (IMU 200 Hz, LiDAR 10 Hz, 2 cm of range noise) was carried {:.1f} m through a simulated room for {:.0f} s.\n",
             e.path_length_m, e.duration_s);
  fmt::print("KILVO estimated its way from the recording alone; against the truth:\n");
  fmt::print("  position error      {:.1f} mm rms, {:.1f} mm at most\n", 1e3 * e.ate_rmse_m, 1e3 * e.ate_max_m);
  fmt::print("  orientation error   {:.3f} degrees rms\n", e.rotation_rmse_deg);
  fmt::print("  drift from start to end  {:.1f} mm\n", 1e3 * e.e2e_m);
  fmt::print("  {}\n", judged.diverged ? "This is NOT as it should be." : "As it should be.");
  fmt::print("Look at:\n");
  fmt::print("  {}  pictures of all of it, for a browser\n", (results / "report.html").string());
  fmt::print("  {}  the map, for MeshLab or CloudCompare\n", (results / "map.ply").string());
  fmt::print("  {}  the trajectory, t x y z qx qy qz qw\n", (results / "odometry.tum").string());
  fmt::print("  {}  everything about the run\n", (results / "summary.json").string());
  fmt::print("Again by hand: kilvo run {} --out {}\n", folder.string(), results.string());
}

int demo(const DemoOptions& options) {
  if (!(options.duration >= 3) || options.duration > 3600) throw UsageError("--duration must be 3 to 3600 seconds");
  const fs::path folder = options.out, results = folder / "results";
  prepare_folder(folder);
  simulate(options, folder);
  RunOptions run;
  run.input = folder.string();
  run.out = results;
  run.config = (folder / "config.yaml").string();
  run.quiet = options.quiet;
  const int code = run_recording(run);
  if (code != done) return code;
  const lab::Evaluation e = lab::evaluate(lab::read_tum(results / "sweeps.tum"), lab::read_tum(folder / "gt.tum"), lab::Alignment::se3);
  write_text_file(results / "report.html", lab::make_report({results, folder / "gt.tum", {}}).html);
  tell(folder, results, e);
  return lab::judge_divergence(e).diverged ? run_failed : done;
}

}  // namespace

void add_demo(CLI::App& program, Action& chosen) {
  auto options = std::make_shared<DemoOptions>();
  CLI::App* verb = program.add_subcommand("demo", "simulate a walk through a room, run on it, compare with the truth");
  verb->add_option("--out", options->out, "folder for everything; default: demo")->type_name("DIR");
  verb->add_option("--seed", options->seed, "of the simulated noise; default: 1")->type_name("N");
  verb->add_option("--duration", options->duration, "of the walk; default: 20")->type_name("S");
  verb->add_flag("--quiet", options->quiet, "no progress");
  verb->callback([options, &chosen] { chosen = [options] { return demo(*options); }; });
}

}  // namespace kilvo::cli
