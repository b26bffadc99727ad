// kilvo eval EST.tum GT.tum
#include <filesystem>
#include <fmt/core.h>
#include <memory>

#include "apps/cli/exit_code.hpp"
#include "apps/cli/verbs.hpp"
#include "lab/evaluation/evaluate.hpp"
#include "lab/settings/nearest.hpp"

namespace kilvo::cli {
namespace {

struct EvalOptions {
  std::string estimate, truth;
  std::string align = "se3";
  bool json = false;
};

// A run without LiDAR has no sweeps; its poses are beside them.
std::vector<lab::StampedPose> read_estimate(const std::string& path) {
  std::vector<lab::StampedPose> poses = lab::read_tum(path);
  const std::filesystem::path odometry = std::filesystem::path(path).parent_path() / "odometry.tum";
  std::error_code error;
  if (poses.empty() && std::filesystem::path(path).filename() == "sweeps.tum" && std::filesystem::exists(odometry, error)) {
    throw lab::EvaluationError(
        fmt::format("{}: no poses in it: the run had no LiDAR sweeps; evaluate {} instead", path, odometry.string()));
  }
  return poses;
}

int evaluate_files(const EvalOptions& options) {
  const lab::Alignment alignment = alignment_or_refuse(options.align);
  const auto estimate = read_estimate(options.estimate), truth = lab::read_tum(options.truth);
  lab::Evaluation result = lab::evaluate(estimate, truth, alignment);
  // What a tilt of the world hides in the one shows in the other.
  if (alignment != lab::Alignment::yaw) result.ate_rmse_yaw_m = lab::evaluate(estimate, truth, lab::Alignment::yaw).ate_rmse_m;
  fmt::print("{}", options.json ? lab::to_json(result) : lab::to_text(result));
  return done;
}

}  // namespace

lab::Alignment alignment_or_refuse(const std::string& name) {
  if (const auto alignment = lab::alignment_of(name)) return *alignment;
  const std::vector<std::string> names{"se3", "yaw", "first"};
  throw UsageError(fmt::format("--align must be se3, yaw or first, not '{}', nearest is '{}'", name, lab::nearest(name, names)));
}

void add_eval(CLI::App& program, Action& chosen) {
  auto options = std::make_shared<EvalOptions>();
  CLI::App* verb = program.add_subcommand("eval", "compare a trajectory with the truth");
  verb->add_option("EST", options->estimate, "estimated trajectory (TUM: t x y z qx qy qz qw)")->required();
  verb->add_option("GT", options->truth, "true trajectory (TUM), of the same body")->required();
  verb->add_option("--align", options->align,
                   "se3 (6 degrees of freedom, the default), yaw (position and heading), first (the first poses coincide)");
  verb->add_flag("--json", options->json, "print one JSON object");
  verb->callback([options, &chosen] { chosen = [options] { return evaluate_files(*options); }; });
}

}  // namespace kilvo::cli
