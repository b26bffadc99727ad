// kilvo run INPUT --out DIR
#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <memory>
#include <thread>

#include "apps/cli/exit_code.hpp"
#include "apps/cli/run_recording.hpp"
#include "apps/cli/sensor_choice.hpp"
#include "apps/cli/verbs.hpp"

namespace kilvo::cli {
namespace {

struct RunWords {
  RunOptions options;
  std::string out, map, config;
  std::optional<std::string> sensors;
  std::vector<std::string> drops, degradations, delays;
  std::optional<double> realtime;
  bool no_map = false;
  int threads = 0;  // 0: as many as there are cores
};

int run(RunWords words) {
  RunOptions& options = words.options;
  options.out = words.out;
  if (!words.config.empty()) options.config = words.config;
  if (words.sensors) options.sensors = parse_sensors(*words.sensors);
  for (const std::string& text : words.drops) options.failures.push_back(parse_drop(text));
  for (const std::string& text : words.degradations) options.failures.push_back(parse_degradation(text));
  for (const std::string& text : words.delays) options.failures.push_back(parse_delay(text));
  options.realtime = words.realtime;
  if (options.realtime && !(*options.realtime > 0 && *options.realtime <= 1000))
    throw UsageError("--realtime must be a speed above 0 and at most 1000");
  if (words.no_map && !words.map.empty()) throw UsageError("--map and --no-map exclude each other");
  if (!words.map.empty()) options.map = words.map;
  options.with_map = !words.no_map;
  const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  options.threads = words.threads > 0 ? std::min(words.threads, cores) : cores;
  if (!(options.start >= 0) || std::isinf(options.start)) throw UsageError("--start must be a number of seconds, 0 or more");
  if (!(options.duration > 0)) throw UsageError("--duration must be a number of seconds above 0");
  return run_recording(options);
}

}  // namespace

void add_run(CLI::App& program, Action& chosen) {
  auto words = std::make_shared<RunWords>();
  RunOptions& options = words->options;
  CLI::App* verb = program.add_subcommand("run", "estimate trajectory and map from a recording");
  verb->add_option(
          "INPUT", options.inputs,
          "a ROS 1 bag, an MCAP file, a .db3 or folder of rosbag2, or a folder with recording.bag in it; several are one recording")
      ->required()
      ->expected(1, -1);
  verb->add_option("--out", words->out, "folder for the results, created if need be")->type_name("DIR")->required();
  verb->add_option("--config", words->config,
                   "robot, sensors, topics and tuning; default: config.yaml in INPUT if that is a folder, else the shipped robots/g1.yaml")
      ->type_name("FILE");
  verb->add_option("--set", options.overrides, "override one setting, repeatable (lidar.voxel_size=0.2)")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  verb->add_option("--sensors", words->sensors, "use only these of legs,imu,lidar,camera; default: all that are configured and recorded")
      ->type_name("LIST");
  verb->add_option("--drop", words->drops,
                   "leave out a sensor's messages between two times (lidar:10-16; lidar:10- to the end), repeatable")
      ->type_name("SENSOR:T0-T1")
      ->allow_extra_args(false);
  verb->add_option("--degrade", words->degradations,
                   "degrade a sensor's data between two times: dark or blank images, scans of a narrow sector, an accel or gyro that is "
                   "frozen (dark:10-16), repeatable")
      ->type_name("KIND:T0-T1")
      ->allow_extra_args(false);
  verb->add_option("--realtime", words->realtime, "play it through the live runner, so many times as fast as it was recorded (1)")
      ->type_name("[SPEED]");
  verb->add_option("--delay", words->delays, "let a sensor's messages arrive so many milliseconds later (camera:50), repeatable")
      ->type_name("SENSOR:MS")
      ->allow_extra_args(false);
  verb->add_option("--start", options.start, "begin this many seconds into the recording")->type_name("S");
  verb->add_option("--duration", options.duration, "end after this many seconds")->type_name("S");
  verb->add_option("--map", words->map, "write the map there instead of DIR/map.ply")->type_name("FILE.ply");
  verb->add_flag("--no-map", words->no_map, "write no map");
  verb->add_flag("--mcap", options.mcap, "write DIR/run.mcap too: poses, transforms, contacts, clouds, times, events, for Foxglove");
  verb->add_flag("--no-deskew", options.no_deskew, "take each cloud at its stamp, as if its points had been measured at once");
  verb->add_flag("--trust-description", options.trust_description,
                 "do not check the description against the data, which costs seconds; for runs on a recording that was checked before");
  verb->add_option("--threads", words->threads, "default: all cores; results do not depend on it")
      ->type_name("N")
      ->check(CLI::Range(1, 1024));
  verb->add_flag("--quiet", options.quiet, "no progress, only warnings and errors");
  verb->callback([words, &chosen] { chosen = [words] { return run(*words); }; });
}

}  // namespace kilvo::cli
