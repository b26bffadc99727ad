// kilvo simulate SCENARIO --out DIR: a walk with all sensors and the truth, written as a recording.
#include <fmt/core.h>
#include <memory>

#include "apps/cli/exit_code.hpp"
#include "apps/cli/simulation_folder.hpp"
#include "apps/cli/verbs.hpp"
#include "lab/simulation/rough.hpp"

namespace kilvo::cli {
namespace {

int simulate(const std::string& out, const SimulationOptions& options) {
  const double seconds = simulate_into(out, options);
  if (!options.quiet) fmt::print("{}: {:.1f} s of '{}', seed {}\n", out, seconds, options.scenario, options.seed);
  return done;
}

}  // namespace

void add_simulate(CLI::App& program, Action& chosen) {
  auto out = std::make_shared<std::string>();
  auto options = std::make_shared<SimulationOptions>();
  CLI::App* verb = program.add_subcommand("simulate", "walk a simulated humanoid and record its sensors, with the truth");
  verb->add_option("SCENARIO", options->scenario, "which walk, see below")->required();
  verb->add_option("--out", *out, "folder for the recording and the truth, created if need be")->type_name("DIR")->required();
  verb->add_option("--seed", options->seed, "seed of furniture, textures and noise; default: 1")
      ->type_name("N")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{1'000'000'000}));
  verb->add_option("--duration", options->duration, "end after so many seconds; default: when the walk ends")->type_name("S");
  verb->add_option("--sensors", options->sensors, "record only these of legs,imu,lidar,camera, with the same data; default: all")
      ->type_name("LIST");
  verb->add_option("--stride", options->stride, "factor on the length of the steps; default: 1")->type_name("X");
  verb->add_option("--lidar-points", options->lidar_points, "points of a sweep")->type_name("N")->check(CLI::Range(500, 500'000));
  verb->add_option("--lidar-rate", options->lidar_rate, "rate of the sweeps")->type_name("HZ")->check(CLI::Range(1.0, 50.0));
  verb->add_option("--image-width", options->image_width, "width of the images, with the same field of view")
      ->type_name("PIXELS")
      ->check(CLI::Range(160, 3840));
  add_wear_options(*verb, options->wear);
  verb->add_option("--rough", options->rough,
                   "a robot with calibration errors, well (1) or badly (2) maintained; the description is the nominal one")
      ->type_name("LEVEL")
      ->check(CLI::Range(0, 2));
  verb->add_option("--rough-only", options->rough_only, fmt::format("only these parts of the errors: {}", lab::names_of({})))
      ->type_name("PARTS");
  verb->add_flag("--quiet", options->quiet, "no progress, only errors");
  verb->footer(list_of_scenarios());
  verb->callback([out, options, &chosen] { chosen = [out, options] { return simulate(*out, *options); }; });
}

}  // namespace kilvo::cli
