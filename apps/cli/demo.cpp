// kilvo demo: simulate a walk through a room, run on it, compare with the truth, show it, say where to look.
#include <fmt/core.h>
#include <memory>

#include "apps/cli/exit_code.hpp"
#include "apps/cli/output_folder.hpp"
#include "apps/cli/run_recording.hpp"
#include "apps/cli/simulation_folder.hpp"
#include "apps/cli/verbs.hpp"
#include "lab/evaluation/contacts.hpp"
#include "lab/evaluation/evaluate.hpp"
#include "lab/evaluation/trajectory_file.hpp"
#include "lab/report/report.hpp"

namespace kilvo::cli {
namespace {

namespace fs = std::filesystem;

struct DemoOptions {
  std::string out = "demo";
  std::int64_t seed = 1;
  double duration = 30;
  bool quiet = false;
};

void tell(const fs::path& folder, const fs::path& results, const lab::Evaluation& e, const lab::ContactEvaluation& contacts) {
  const lab::Divergence judged = lab::judge_divergence(e);
  fmt::print("\nA humanoid (joints 1 kHz, IMU 200 Hz, LiDAR and camera 10 Hz) walked {:.1f} m through a simulated room in {:.0f} s.\n",
             e.path_length_m, e.duration_s);
  fmt::print("KILVO estimated the trajectory from the recording alone. {} Against the truth:\n",
             judged.diverged ? "This is NOT as it should be." : "As it should be.");
  fmt::print("  position error      {:.1f} mm rms, {:.1f} mm at most; orientation {:.3f} degrees rms\n", 1e3 * e.ate_rmse_m,
             1e3 * e.ate_max_m, e.rotation_rmse_deg);
  fmt::print("  drift from start to end  {:.1f} mm\n", 1e3 * e.e2e_m);
  if (contacts.walks)
    fmt::print("  feet on the ground  {:.1f} % of the time reported right, without force sensors\n", 100 * contacts.accuracy);
  fmt::print("Look at:\n");
  fmt::print("  {}  pictures of all of it, for a browser\n", (results / "report.html").string());
  fmt::print("  {}  the map, for MeshLab or CloudCompare\n", (results / "map.ply").string());
  fmt::print("  {}  everything about the run, its times among it\n", (results / "summary.json").string());
  fmt::print("Again by hand: kilvo run {} --out {}\n", folder.string(), results.string());
  fmt::print("The picture: file://{}\n", fs::absolute(results / "report.html").lexically_normal().string());
}

int demo(const DemoOptions& options) {
  if (!(options.duration >= 3) || options.duration > 3600) throw UsageError("--duration must be 3 to 3600 seconds");
  const fs::path folder = options.out, results = folder / "results";
  simulate_into(folder, {"room", options.seed, options.duration, options.quiet});
  RunOptions run;
  run.inputs = {folder.string()};
  run.out = results;
  run.config = (folder / "config.yaml").string();
  run.quiet = options.quiet;
  const int code = run_recording(run);
  if (code != done) return code;
  const lab::Evaluation e = lab::evaluate(lab::read_tum(results / "sweeps.tum"), lab::read_tum(folder / "gt.tum"), lab::Alignment::se3);
  const fs::path contact_truth = folder / "contacts.gt.csv";
  const lab::ContactEvaluation contacts =
      lab::evaluate_contacts(lab::read_contacts(results / "contacts.csv"), lab::read_contacts(contact_truth));
  write_text_file(results / "report.html", lab::make_report({results, folder / "gt.tum", contact_truth}).html);
  tell(folder, results, e, contacts);
  return lab::judge_divergence(e).diverged ? run_failed : done;
}

}  // namespace

void add_demo(CLI::App& program, Action& chosen) {
  auto options = std::make_shared<DemoOptions>();
  CLI::App* verb = program.add_subcommand("demo", "simulate a walk through a room, run on it, compare with the truth");
  verb->add_option("--out", options->out, "folder for everything; default: demo")->type_name("DIR");
  verb->add_option("--seed", options->seed, "of the simulated noise; default: 1")
      ->type_name("N")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{1'000'000'000}));
  verb->add_option("--duration", options->duration, "of the walk; default: 30")->type_name("S");
  verb->add_flag("--quiet", options->quiet, "no progress");
  verb->callback([options, &chosen] { chosen = [options] { return demo(*options); }; });
}

}  // namespace kilvo::cli
