#include "apps/cli/run_recording.hpp"

#include <algorithm>
#include <chrono>
#include <fmt/core.h>
#include <memory>
#include <utility>

#include "apps/cli/exit_code.hpp"
#include "apps/cli/interrupt.hpp"
#include "apps/cli/joint_advice.hpp"
#include "apps/cli/known_description.hpp"
#include "apps/cli/level_files.hpp"
#include "apps/cli/make_estimator.hpp"
#include "apps/cli/map_keeper.hpp"
#include "apps/cli/output_folder.hpp"
#include "apps/cli/pace.hpp"
#include "apps/cli/progress.hpp"
#include "apps/cli/read_ahead.hpp"
#include "apps/cli/recording_options.hpp"
#include "apps/cli/result_files.hpp"
#include "apps/cli/run_failure.hpp"
#include "apps/cli/sensor_choice.hpp"
#include "apps/cli/shipped_config.hpp"
#include "apps/cli/skeleton_file.hpp"
#include "apps/cli/summary.hpp"
#include "apps/live/live_runner.hpp"
#include "kilvo/estimator/estimator.hpp"
#include "lab/doctor/description_watch.hpp"
#include "lab/mapping/ply.hpp"
#include "lab/run_log/run_log.hpp"

namespace kilvo::cli {
namespace {

void tell_start(const RunFacts& facts, const lab::RecordingSource& source) {
  fmt::print(stderr, "kilvo: configuration {}\n", facts.config_file);
  for (const Sensor sensor : facts.sensors) {
    const std::string detail = sensor == Sensor::lidar ? ", " + source.point_time_text() : "";
    fmt::print(stderr, "kilvo: {} from {}{}\n", name_of(sensor), source.topic(sensor), detail);
  }
}

/// Everything between the first message and the last file.
class Run {
 public:
  /// facts.sensors: those of `used` that are left, none when nothing can be estimated.
  Run(const RunOptions& options, InterruptWatch& interrupt, const lab::Settings& settings, const std::vector<Sensor>& used, RunFacts facts,
      const KnownDescription& known)
      : options_(options),
        interrupt_(interrupt),
        known_(known),
        used_(used),
        settings_(settings),
        facts_(std::move(facts)),
        source_({options.inputs.begin(), options.inputs.end()}, recording_options(options, settings_, read())),
        failing_(source_, options.failures, source_.begin(), [this] { return source_.recorded(); }),
        estimator_(make_estimator(settings_, read())),
        map_(settings_.mapping, options.threads > 1 || options.realtime),
        files_(options.out, settings_.estimator.smooth_time),
        level_(files_, settings_.estimator.gravity_align),
        log_(options.mcap ? std::make_unique<lab::RunLog>(options.out / "run.mcap",
                                                          std::array{settings_.robot.feet[0].name, settings_.robot.feet[1].name})
                          : nullptr),
        skeleton_(options.out / "skeleton.csv", settings_.robot),
        description_(
            settings_.robot, {settings_.leg_clock.clock != "stamp", source_.is_without_deskew()},
            options.threads > 1 || options.realtime ? lab::DescriptionWatch::Judging::beside : lab::DescriptionWatch::Judging::here),
        progress_(Progress::style_for(options.quiet)) {
    if (!options.quiet) tell_start(facts_, source_);
  }

  /// None: the description is wrong, as wrong() says, and the run has to begin anew.
  std::optional<int> all() {
    const bool interrupted = options_.realtime ? replay_live() : !facts_.sensors.empty() && replay();
    progress_.finish();
    if (!stopped_) level_.finish();
    if (known_.is_judged() && !stopped_ && !interrupted) wrong_ = description_.finish();
    if (!options_.realtime && std::ranges::any_of(wrong_, [this](const auto& wrong) { return known_.stops(wrong); })) return std::nullopt;
    files_.write_events(estimator_.take_events());
    if (!interrupted) settle_description();
    if (facts_.failure.empty()) facts_.failure = failure(interrupted);
    if (!interrupted) warn_of_no_effect(failing_, facts_.sensors, facts_.warnings);
    files_.close();
    if (log_) log_->close();
    skeleton_.close();
    for (const Sensor sensor : facts_.sensors) facts_.withheld[static_cast<std::size_t>(sensor)] = failing_.dropped(sensor);
    const lab::MapBuilder& map = map_.finish();
    if (options_.with_map) lab::write_ply(options_.map.value_or(options_.out / "map.ply"), map, level_.turn().value_or(SO3()));
    facts_.map_points = map.size();
    facts_.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - facts_.begin).count();
    write_text_file(options_.out / "summary.json",
                    summary_json(facts_, settings_, source_, estimator_.statistics(), level_.event(), files_.run_summary()));
    tell_end();
    return facts_.failure.empty() ? done : run_failed;
  }
  const std::vector<lab::WrongDescription>& wrong() const { return wrong_; }

 private:
  // Said as soon as the evidence is in; the files get it at the end, where it does not depend on how fast it was judged.
  void hold_against_description(const Measurement& measurement) {
    if (!known_.is_judged() || options_.trust_description) return;
    description_.take(measurement);
    for (lab::WrongDescription& wrong : description_.news()) {
      progress_.finish();
      fmt::print(stderr, "kilvo: {}: after {:.1f} s of data: {}\n", wrong.spoils ? "error" : "warning", wrong.after, wrong.finding.text);
      stopped_ = stopped_ || (known_.stops(wrong) && !options_.realtime);
      wrong_.push_back(std::move(wrong));
    }
  }

  // A run with a wrong description has failed, however good it looks.
  void settle_description() {
    for (const lab::Change& c : known_.refined) facts_.warnings.push_back(fmt::format("calibration.online: {}: {}", c.key, c.value));
    for (const lab::Change& c : known_.mended) facts_.warnings.push_back(fmt::format("restarted with {}: {}", c.key, c.value));
    wrong_.insert(wrong_.begin(), known_.wrong.begin(), known_.wrong.end());
    for (const lab::WrongDescription& wrong : wrong_) {
      const lab::Finding& finding = wrong.finding;
      facts_.warnings.push_back(fmt::format("{}; {}", finding.text, finding.remedy));
      files_.write_description(wrong.t, finding.sensor, wrong.spoils, finding.size, facts_.warnings.back());
      if (!facts_.failure.empty() || !wrong.spoils) continue;
      facts_.failure = wrong.has_changed ? finding.text
                                         : fmt::format("the robot's description is wrong: {} (kilvo doctor shows the evidence){}",
                                                       finding.text, consequence(known_, used_, facts_.sensors));
    }
  }

  // Of a run without senses the messages are looked at alone.
  const std::vector<Sensor>& read() const { return facts_.sensors.empty() ? used_ : facts_.sensors; }

  // True when the user stopped it.
  bool replay() {
    ReadAhead input(
        failing_, [this] { return source_.progress(); }, [this] { return failing_.arrived(); }, options_.threads > 1);
    bool interrupted = false;
    while (auto measurement = input.next()) {
      require_legs(*measurement);
      skeleton_.add(*measurement);
      hold_against_description(*measurement);
      if (stopped_) break;
      outputs_.clear();
      estimator_.push(*std::move(measurement), outputs_);
      keep(outputs_);
      progress_.update(input.progress(), [this] { return progress_note(); });
      if ((interrupted = interrupt_.poll())) break;
    }
    input.stop();
    if (stopped_) return false;
    outputs_ = estimator_.finish();
    keep(outputs_);
    return interrupted;
  }

  bool replay_live() {
    live::LiveRunner runner(estimator_, settings_.robot, settings_.estimator, as_flags(facts_.sensors), settings_.live,
                            {[this](Output output) {
                               if (output.epoch > 0) return;
                               if (log_) log_->write_state(output);
                               level_.hold(output, HeldOutput::Part::state);
                             },
                             [this](Output output) {
                               if (output.epoch > 0) return;
                               if (log_) log_->write_sweep(output);
                               level_.hold(output, HeldOutput::Part::sweep);
                               keep_map(output);
                             }});
    ReadAhead input(
        failing_, [this] { return source_.progress(); }, [this] { return failing_.arrived(); }, true);
    Pace pace(*options_.realtime);
    bool interrupted = false;
    while (auto measurement = input.next()) {
      require_legs(*measurement);
      skeleton_.add(*measurement);
      hold_against_description(*measurement);
      interrupted = !pace.wait_for(input.arrived(), interrupt_);
      if (interrupted || runner.failed()) break;
      runner.push(*std::move(measurement));
      progress_.update(input.progress(), [&runner] { return runner.waiting_for(); });
    }
    input.stop();
    runner.stop();
    facts_.live = runner.statistics();
    return interrupted;
  }

  // The first messages of the legs show whether they are of the robot in the configuration. Hands and heads may speak on the same topic.
  void require_legs(const Measurement& m) {
    const auto* joints = std::get_if<JointSample>(&m);
    if (joints == nullptr || joints->position.empty() || legs_seen_) return;
    const auto why = estimator_.mismatch(*joints);
    if (legs_seen_ = !why; why && ++foreign_legs_ == 20)  // messages
      throw lab::ConfigError(fmt::format("{}: {} (topic {}); {}", facts_.config_file, *why, source_.topic(Sensor::legs),
                                         joint_advice(settings_.robot, joints->names)));
  }

  void keep(std::vector<Output>& outputs) {
    for (Output& output : outputs) {
      if (output.epoch > 0) continue;  // of another recording: failure() says so
      if (log_) log(output);
      level_.look(output);
      level_.hold(output, HeldOutput::Part::whole);
      keep_map(output);
    }
  }

  // As a live runner would have answered.
  void log(Output output) {
    if (settings_.estimator.gravity_align) answered_.add(output);
    if (answered_.turn()) Levelling::apply(*answered_.turn(), output);
    log_->write_state(output);
    log_->write_sweep(output);
  }

  // In the world as it began, in which the map is one: it is turned as a whole.
  void keep_map(Output& output) {
    if (!options_.with_map) return;
    if (output.R_LW) Levelling::apply(output.R_LW->inverse(), output);
    if (output.is_sweep) map_.add(std::move(output.points_W));
    if (!output.coloured.empty()) map_.colour(std::move(output.coloured));
  }

  std::string progress_note() const {
    if (!estimator_.initialised()) return estimator_.waiting_for();
    return fmt::format("{} sweeps, {:.1f} m", files_.run_summary().sweeps(), files_.run_summary().path_length());
  }
  std::string failure(bool interrupted) const {
    return interrupted ? "stopped by the user" : failure_of(files_.run_summary(), estimator_, source_);
  }

  void tell_end() const {
    const RunSummary& summary = files_.run_summary();
    const auto warnings = facts_.sensors.empty() ? facts_.warnings : all_warnings(facts_, source_, estimator_.statistics());
    for (const std::string& text : warnings) fmt::print(stderr, "kilvo: warning: {}\n", text);
    if (!warnings.empty() && !options_.quiet) fmt::print(stderr, "kilvo: what to do about warnings: docs/troubleshooting.md\n");
    if (!facts_.failure.empty()) fmt::print(stderr, "kilvo: error: {}\n", facts_.failure);
    if (options_.quiet) return;
    fmt::print("{}: {} poses, {} sweeps, path {:.2f} m, start to end {:.3f} m, {:.1f} s of data in {:.2f} s\n", options_.out.string(),
               summary.outputs(), summary.sweeps(), summary.path_length(), summary.start_to_end(), summary.seconds(), facts_.wall_seconds);
  }

  const RunOptions& options_;
  InterruptWatch& interrupt_;
  const KnownDescription& known_;
  const std::vector<Sensor>& used_;
  std::vector<lab::WrongDescription> wrong_;  // found in this round
  bool stopped_ = false;                      // by that
  lab::Settings settings_;
  RunFacts facts_;
  lab::RecordingSource source_;
  lab::FailingSource failing_;
  Estimator estimator_;
  std::vector<Output> outputs_;  // of one measurement
  MapKeeper map_;
  ResultFiles files_;
  LevelFiles level_;
  Levelling answered_{Duration::max()};  // as a live runner does it
  std::unique_ptr<lab::RunLog> log_;
  SkeletonFile skeleton_;
  lab::DescriptionWatch description_;
  Progress progress_;
  bool legs_seen_ = false;
  int foreign_legs_ = 0;
};

}  // namespace

int run_recording(const RunOptions& options) {
  RunFacts facts;
  const std::filesystem::path config = config_file(options.config, options.inputs.front());
  lab::Settings settings = lab::load_settings(config, options.overrides);
  prepare_folder(options.out);
  claim_folder(options.out);
  remove_results(options.out);
  if (options.map) prepare_folder(std::filesystem::absolute(*options.map).parent_path());
  const SensorChoice choice = choose_sensors(options.sensors, settings, config.string(), options.inputs);
  lab::require_complete(settings, choice.used);
  facts.input = joined(options.inputs);
  facts.config_file = config.string();
  facts.sensors = choice.used;
  facts.warnings = choice.warnings;
  InterruptWatch interrupt;  // before any thread, so that none of them takes the signal
  // No trajectory leaves that a wrong description has spoilt: a round that it stops is followed by another one.
  for (KnownDescription known = refined(settings, options, config, choice.used);;) {
    if (known.round > 1 || !known.refined.empty()) settings = mended(known, options, config);
    if (known.round > 1) {
      facts.sensors = sound(choice.used, known);
      remove_results(options.out);
      if (!options.quiet) fmt::print(stderr, "kilvo: the run restarts{}\n", consequence(known, choice.used, facts.sensors));
    }
    fit_to_machine(settings, options.realtime.has_value(), options.threads);
    settings.estimator.sweep_points = options.with_map || options.mcap;
    auto run = std::make_unique<Run>(options, interrupt, settings, choice.used, facts, known);
    if (const std::optional<int> code = run->all()) return *code;
    const std::vector<lab::WrongDescription> found = run->wrong();
    run.reset();
    known = next_round(std::move(known), found, options, config, choice.used);
  }
}

}  // namespace kilvo::cli
