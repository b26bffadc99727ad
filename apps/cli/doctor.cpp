// kilvo doctor INPUT --config FILE, kilvo calibrate INPUT --config FILE --out FILE
#include <algorithm>
#include <filesystem>
#include <fmt/core.h>
#include <fstream>
#include <memory>
#include <sstream>

#include "apps/cli/exit_code.hpp"
#include "apps/cli/lidar_mount.hpp"
#include "apps/cli/output_folder.hpp"
#include "apps/cli/recording_options.hpp"
#include "apps/cli/sensor_choice.hpp"
#include "apps/cli/shipped_config.hpp"
#include "apps/cli/verbs.hpp"
#include "lab/doctor/calibration_page.hpp"
#include "lab/doctor/diagnosis_text.hpp"
#include "lab/doctor/examination.hpp"
#include "lab/messages/input_error.hpp"
#include "lab/recordings/recording_source.hpp"
#include "lab/settings/edit_settings.hpp"

namespace kilvo::cli {
namespace {

namespace fs = std::filesystem;

struct DoctorOptions {
  std::string input, config, write, report;
  std::vector<std::string> overrides;
  double start = 0, duration = 60;
  bool json = false;
  bool exact = false;  // all points of the LiDAR
};

lab::Recorded record(const DoctorOptions& options, lab::RecordingOptions wanted) {
  wanted.start = options.start;
  wanted.duration = options.duration;
  const auto read = [&options, without_deskew = wanted.no_deskew](const lab::RecordingOptions& what) {
    lab::RecordingSource source(options.input, what);
    lab::Recorder recorder({what.leg_clock.has_value(), without_deskew, options.exact});
    while (const auto measurement = source.next()) recorder.push(*measurement);
    for (const std::string& text : source.warnings()) fmt::print(stderr, "kilvo: warning: {}\n", text);
    return recorder.finish();
  };
  if (!wanted[Sensor::lidar].use) return read(wanted);
  try {
    return read(wanted);
  } catch (const lab::InputError&) {
    // Clouds without point times are a finding, not the end.
    wanted.no_deskew = true;
    return read(wanted);
  }
}

std::string text_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return std::move(text).str();
}

void override_with(DoctorOptions& options, const std::vector<lab::Change>& changes) {
  for (const lab::Change& c : changes) options.overrides.push_back(c.key + "=" + c.value);
}

/// The configuration with these settings; everything else as it is.
void write_changed(const fs::path& from, const fs::path& to, const lab::Settings& settings, const std::vector<lab::Change>& changes) {
  std::string text = text_of(from);
  for (const lab::Change& change : changes) text = lab::with_setting(text, change.key, change.value);
  // A relative path means one from the configuration's own folder.
  const bool elsewhere = fs::weakly_canonical(fs::absolute(to)).parent_path() != fs::weakly_canonical(fs::absolute(from)).parent_path();
  if (elsewhere && settings.given.contains("robot.urdf")) text = lab::with_setting(text, "robot.urdf", settings.urdf_file);
  while (text.ends_with('\n')) text.pop_back();  // written with one
  write_text_file(to, text);
  fmt::print(stderr, "kilvo: {} with {} setting{} changed\n", to.string(), changes.size(), changes.size() == 1 ? "" : "s");
}

struct Judged {
  fs::path config;
  lab::Settings settings;
  lab::Diagnosis diagnosis;
  std::vector<lab::Refinement> refinements;
  bool without_deskew = false;  // it was read so
};

Judged judge(const DoctorOptions& options) {
  const auto config = config_file(options.config.empty() ? std::nullopt : std::optional(options.config), options.input);
  const lab::Settings settings = lab::load_settings(config, options.overrides);
  const SensorChoice choice = choose_sensors(std::nullopt, settings, config.string(), {options.input});
  for (const std::string& text : choice.warnings) fmt::print(stderr, "kilvo: warning: {}\n", text);
  fmt::print(stderr, "kilvo: looking at {:.0f} s of {}\n", options.duration, options.input);
  const lab::Recorded recorded = record(options, recording_options(settings, choice.used));
  lab::Examination examination(recorded, settings.robot);
  lab::Diagnosis diagnosis = examination.run();
  return {config, settings, std::move(diagnosis), examination.refinements(), recorded.reading.without_deskew};
}

int doctor(const DoctorOptions& options) {
  const Judged judged = judge(options);
  const lab::Diagnosis& diagnosis = judged.diagnosis;
  fmt::print("{}", options.json ? lab::to_json(diagnosis) : lab::to_text(diagnosis));
  if (!options.write.empty()) {
    std::vector<lab::Change> changes;
    for (const lab::Finding& f : diagnosis.findings) {
      if (f.changes.empty()) fmt::print(stderr, "kilvo: not changed by --write: {}: {}\n", name_of(f.sensor), f.remedy);
      lab::put(changes, f.changes);
    }
    write_changed(judged.config, options.write, judged.settings, changes);
  }
  if (!diagnosis.good()) return run_failed;
  return diagnosis.unknown() ? unusable_input : done;
}

/// By the estimator, which knows the LiDAR's way better than the judgement of the description does.
void refine_by_estimator(Judged& judged, const SO3& described, const DoctorOptions& options) {
  lab::RecordingOptions wanted = recording_options(judged.settings, {Sensor::imu, Sensor::lidar});
  if (!judged.diagnosis.good() || !can_refine_lidar_position(judged.refinements, judged.without_deskew || wanted.no_deskew)) return;
  wanted.start = options.start;
  wanted.duration = options.duration;
  fmt::print(stderr, "kilvo: measuring the position of the LiDAR on the IMU by a run on these two\n");
  lab::RecordingSource source(options.input, wanted);
  refine_lidar_position(judged.refinements, described, judged.settings, source, options.duration);
}

/// Mends what is too large to be refined, each time by what the settings before left.
Judged mend_first(DoctorOptions& options, std::vector<lab::Finding>& mended) {
  constexpr int most_rounds = 4;
  Judged judged = judge(options);
  const SO3 described = judged.settings.robot.lidar.T_imu_lidar.R;
  for (int round = 1; !judged.diagnosis.good() && round < most_rounds; ++round) {
    const auto& findings = judged.diagnosis.findings;
    if (std::ranges::any_of(findings, [](const lab::Finding& f) { return f.changes.empty(); })) break;
    for (const lab::Finding& f : findings) {
      mended.push_back(f);
      for (const lab::Change& c : f.changes) fmt::print(stderr, "kilvo: calibrate: {}; mended by {}: {}\n", f.text, c.key, c.value);
      override_with(options, f.changes);
    }
    judged = judge(options);
  }
  refine_by_estimator(judged, described, options);
  return judged;
}

int calibrate(DoctorOptions options) {
  options.exact = true;
  if (!options.report.empty()) prepare_folder(options.report);
  lab::Calibration page{options.input, options.config, {}, {}, {}};
  const Judged judged = mend_first(options, page.mended);
  if (!judged.diagnosis.good()) {
    fmt::print("{}", options.json ? lab::to_json(judged.diagnosis) : lab::to_text(judged.diagnosis));
    fmt::print(stderr, "kilvo: calibrate: the description is wrong, and no setting mends it (kilvo doctor shows the evidence)\n");
    return run_failed;
  }
  fmt::print("{}", options.json ? lab::to_json(judged.refinements) : lab::to_text(judged.refinements));
  std::vector<lab::Change> changes, refined;
  for (const lab::Finding& f : page.mended) lab::put(changes, f.changes);
  for (const lab::Refinement& r : judged.refinements) {
    if (r.is_taken()) lab::put(refined, r.changes);
  }
  lab::put(changes, refined);
  write_changed(judged.config, options.write, judged.settings, changes);
  if (!options.report.empty()) {
    override_with(options, refined);
    page.config = judged.config.string();
    page.before = judged.refinements;
    Judged after = judge(options);
    refine_by_estimator(after, after.settings.robot.lidar.T_imu_lidar.R, options);
    page.after = after.refinements;
    write_text_file(fs::path(options.report) / "calibration.html", lab::to_html(page));
  }
  return judged.refinements.empty() ? unusable_input : done;
}

void add_common(CLI::App& verb, DoctorOptions& options) {
  verb.add_option("INPUT", options.input, "a recording, or a folder with one in it")->required();
  verb.add_option("--config", options.config,
                  "the description; default: config.yaml in INPUT if that is a folder, else the shipped robots/g1.yaml")
      ->type_name("FILE");
  verb.add_option("--set", options.overrides, "override one setting, repeatable (lidar.time_offset=0.005)")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  verb.add_option("--start", options.start, "begin this many seconds into the recording")->type_name("S");
  verb.add_option("--duration", options.duration, "look at so many seconds; default: 60")->type_name("S");
  verb.add_flag("--json", options.json, "print JSON");
}

}  // namespace

void add_doctor(CLI::App& program, Action& chosen) {
  auto options = std::make_shared<DoctorOptions>();
  CLI::App* verb = program.add_subcommand("doctor", "judge the description of a robot by a recording");
  add_common(*verb, *options);
  verb->add_option("--write", options->write, "write the configuration there with what was found put right")->type_name("FILE");
  verb->callback([options, &chosen] { chosen = [options] { return doctor(*options); }; });
}

void add_calibrate(CLI::App& program, Action& chosen) {
  auto options = std::make_shared<DoctorOptions>();
  CLI::App* verb = program.add_subcommand("calibrate", "measure mounts, focal length and clocks from a recording");
  add_common(*verb, *options);
  verb->add_option("--out", options->write, "the configuration with what is off put right")->type_name("FILE")->required();
  verb->add_option("--report", options->report, "write a page with each value before and after: DIR/calibration.html")->type_name("DIR");
  verb->callback([options, &chosen] { chosen = [options] { return calibrate(*options); }; });
}

}  // namespace kilvo::cli
