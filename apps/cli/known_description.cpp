#include "apps/cli/known_description.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <fmt/ranges.h>
#include <optional>
#include <string_view>

#include "apps/cli/lidar_mount.hpp"
#include "apps/cli/recording_options.hpp"
#include "lab/doctor/examination.hpp"
#include "lab/simulation/failures.hpp"

namespace kilvo::cli {
namespace {

using lab::WrongDescription;

// s of data after those that showed a fault, by which its size is measured.
constexpr double measured_for = 20;

Sensor spoiled_by(const lab::Finding& finding) {
  const std::string_view cause = finding.cause;
  return cause.starts_with("imu_mount") || cause == "imu_link" ? Sensor::legs : finding.sensor;
}

bool has(const std::vector<Sensor>& sensors, Sensor sensor) { return std::ranges::find(sensors, sensor) != sensors.end(); }

// Those of the judgement that stopped the run: which others came until it stopped depends on how fast it was judged.
std::vector<WrongDescription> that_stopped(const KnownDescription& known, const std::vector<WrongDescription>& found) {
  const auto first = std::ranges::find_if(found, [&](const WrongDescription& w) { return known.stops(w); });
  std::vector<WrongDescription> out;
  for (const WrongDescription& w : found) {
    if (first != found.end() && w.t <= first->t) out.push_back(w);
  }
  return out;
}

// More data than any of these had are those after the newest.
WrongDescription last_of(const std::vector<WrongDescription>& wrong) {
  return *std::ranges::max_element(wrong, {}, [](const WrongDescription& w) { return w.t; });
}

struct Measured {
  lab::Diagnosis diagnosis;
  std::vector<lab::Refinement> refinements;
};

// So many seconds of the recording after `from`, or after its beginning, and all before, held against these settings. `exact`: all points
// of the LiDAR.
Measured measured(std::optional<Time> from, double seconds, const RunOptions& options, const lab::Settings& settings,
                  const std::vector<Sensor>& used, bool exact) {
  const lab::RecordingOptions wanted = recording_options(options, settings, used);
  lab::RecordingSource source({options.inputs.begin(), options.inputs.end()}, wanted);
  lab::FailingSource failing(source, options.failures, source.begin(), [&source] { return source.recorded(); });
  lab::Recorder recorder({wanted.leg_clock.has_value(), wanted.no_deskew, exact});
  while (const auto measurement = failing.next()) {
    if (to_seconds(stamp_of(*measurement) - from.value_or(source.begin())) > seconds) break;
    recorder.push(*measurement);
  }
  const lab::Recorded recorded = recorder.finish();
  lab::Examination examination(recorded, settings.robot);
  lab::Diagnosis diagnosis = examination.run();
  return {std::move(diagnosis), examination.refinements()};
}

Measured measured_after(const WrongDescription& first, const RunOptions& options, const lab::Settings& settings, std::vector<Sensor> used,
                        bool exact = true) {
  std::erase(used, Sensor::camera);
  return measured(first.t, measured_for, options, settings, used, exact);
}

std::vector<WrongDescription> as_wrong(const lab::Diagnosis& diagnosis, const WrongDescription& first) {
  std::vector<WrongDescription> out;
  for (const lab::Finding& f : diagnosis.findings) out.push_back(lab::as_wrong(f, first.t, first.after));
  return out;
}

void put_taken(std::vector<lab::Change>& changes, const std::vector<lab::Refinement>& refinements) {
  for (const lab::Refinement& r : refinements) {
    if (r.is_taken()) lab::put(changes, r.changes);
  }
}

// What the first minute says more exactly than the settings of `known` do is added to `to`, its own changes. False where they are wrong
// otherwise.
bool refine(const KnownDescription& known, std::vector<lab::Change>& to, const RunOptions& options, const std::filesystem::path& config,
            std::vector<Sensor> used) {
  if (!options.quiet) fmt::print(stderr, "kilvo: calibrating by the first minute\n");
  constexpr double refined_by = 60;  // s
  constexpr int most_rounds = 4;
  const SO3 as_described = lab::load_settings(config, options.overrides).robot.lidar.T_imu_lidar.R;
  for (int round = 0; round < most_rounds; ++round) {
    const lab::Settings described = mended(known, options, config);
    Measured now = measured(std::nullopt, refined_by, options, described, used, true);
    if (now.diagnosis.good()) {
      if (const auto wanted = recording_options(options, described, {Sensor::imu, Sensor::lidar});
          can_refine_lidar_position(now.refinements, wanted.no_deskew)) {
        lab::RecordingSource source({options.inputs.begin(), options.inputs.end()}, wanted);
        lab::FailingSource failing(source, options.failures, source.begin(), [&source] { return source.recorded(); });
        refine_lidar_position(now.refinements, as_described, described, failing, refined_by);
      }
      put_taken(to, now.refinements);
      return true;
    }
    // That is for the run to find, and to end with; the LiDAR is measured without legs that are wrong.
    const auto ends_a_run = [](const lab::Finding& f) {
      return lab::as_wrong(f, Time{}, 0).spoils || f.changes.empty() || f.cause == "joints_exchanged";
    };
    const auto& findings = now.diagnosis.findings;
    if (std::ranges::any_of(findings, [&](const lab::Finding& f) { return ends_a_run(f) && spoiled_by(f) != Sensor::legs; })) return false;
    if (std::ranges::any_of(findings, ends_a_run)) {
      if (!has(used, Sensor::lidar) || std::erase(used, Sensor::legs) == 0) return false;
      continue;
    }
    // Clocks that the estimator would correct by itself are corrected from the start.
    for (const lab::Finding& f : findings) lab::put(to, f.changes);
  }
  return false;
}

// A run that begins anew does so with the best that its data give: a description of which one part is wrong is seldom exact in the others.
void refine_mended(KnownDescription& known, const WrongDescription& first, bool clocks_alone, const RunOptions& options,
                   const std::filesystem::path& config, const std::vector<Sensor>& used) {
  if (has(used, Sensor::lidar)) {
    std::vector<Sensor> without_camera = used;
    std::erase(without_camera, Sensor::camera);
    KnownDescription exact = known;
    if (refine(exact, exact.mended, options, config, without_camera)) {
      known.mended = exact.mended;
      return;
    }
  }
  if (!clocks_alone) put_taken(known.mended, measured_after(first, options, mended(known, options, config), used).refinements);
}

}  // namespace

KnownDescription refined(const lab::Settings& settings, const RunOptions& options, const std::filesystem::path& config,
                         const std::vector<Sensor>& used) {
  if (!settings.calibration.online) return {};
  KnownDescription known;
  return refine(known, known.refined, options, config, used) ? known : KnownDescription();
}

KnownDescription next_round(KnownDescription known, const std::vector<WrongDescription>& found, const RunOptions& options,
                            const std::filesystem::path& config, const std::vector<Sensor>& used) {
  std::vector<WrongDescription> wrong = that_stopped(known, found);
  if (known.round == 1) {
    const WrongDescription first = last_of(wrong);
    // The same on more data, which measure what is wrong more precisely; and what is still off once that is mended.
    // A clock is no reason to doubt the rest, which is then reported alone. For it a part of the points will do.
    const auto is_clock = [](const WrongDescription& w) { return w.finding.cause.ends_with("_clock"); };
    const auto is_more = [&](const WrongDescription& w) { return known.stops(w) && !is_clock(w); };
    const lab::Settings described = mended(known, options, config);
    bool clocks_alone = std::ranges::none_of(wrong, is_more);
    lab::Diagnosis longer = measured_after(first, options, described, used, !clocks_alone).diagnosis;
    std::vector<WrongDescription> again = as_wrong(longer, first);
    if (clocks_alone && std::ranges::any_of(again, &WrongDescription::spoils)) {
      clocks_alone = false;
      longer = measured_after(first, options, described, used).diagnosis;
      again = as_wrong(longer, first);
    }
    if (std::ranges::any_of(again, [&](const WrongDescription& w) { return known.stops(w); })) wrong = again;
    for (WrongDescription& w : wrong) w.is_mendable &= !clocks_alone || is_clock(w);
    for (WrongDescription& w : wrong) {
      if (lab::is_refuted(w.finding, longer)) lab::refute(w);
    }
    if (!std::ranges::any_of(wrong, [&](const WrongDescription& w) { return known.stops(w); }))
      known.wrong.insert(known.wrong.end(), again.begin(), again.end());
    // Whether joints are exchanged is for a person to decide, and with it what else would change them.
    const bool undecided = std::ranges::any_of(wrong, [](const WrongDescription& w) { return w.finding.cause == "joints_exchanged"; });
    for (WrongDescription& w : wrong) {
      if (undecided && std::ranges::any_of(w.finding.changes, [](const lab::Change& c) { return c.key == "robot.joints"; }))
        w.is_mendable = false;
      else if (known.stops(w))
        lab::put(known.mended, w.finding.changes);
    }
    if (!known.mended.empty()) refine_mended(known, first, clocks_alone, options, config, used);
  } else {
    // What is still wrong must stand up to more data as in the first round, but no more settings are changed for it.
    const lab::Diagnosis longer = measured_after(last_of(wrong), options, mended(known, options, config), sound(used, known)).diagnosis;
    for (WrongDescription& w : wrong) {
      w.is_mendable = false;
      if (lab::is_refuted(w.finding, longer)) lab::refute(w);
    }
  }
  known.wrong.insert(known.wrong.end(), wrong.begin(), wrong.end());
  ++known.round;
  return known;
}

lab::Settings mended(const KnownDescription& known, const RunOptions& options, const std::filesystem::path& config) {
  std::vector<std::string> overrides = options.overrides;
  for (const auto& changes : {known.refined, known.mended}) {
    for (const lab::Change& change : changes) overrides.push_back(change.key + "=" + change.value);
  }
  return lab::load_settings(config, overrides);
}

std::vector<Sensor> sound(const std::vector<Sensor>& used, const KnownDescription& known) {
  std::vector<Sensor> out = used;
  for (const WrongDescription& w : known.wrong) {
    if (w.spoils && !w.is_mendable) std::erase(out, spoiled_by(w.finding));
  }
  if (!has(out, Sensor::lidar)) std::erase(out, Sensor::camera);
  if (!has(out, Sensor::imu) || !(has(out, Sensor::legs) || has(out, Sensor::lidar))) out.clear();
  return out;
}

std::string consequence(const KnownDescription& known, const std::vector<Sensor>& used, const std::vector<Sensor>& left) {
  if (known.round == 1) return "";
  if (left.empty()) return "; nothing is left to estimate with";
  if (known.mended.empty() && left == used) return "";
  std::vector<std::string_view> keys, names;
  for (const lab::Change& change : known.mended) keys.push_back(change.key);
  for (const Sensor sensor : left) names.push_back(name_of(sensor));
  std::string out = "; the results are";
  if (!keys.empty()) out += fmt::format(" with {} corrected", fmt::join(keys, ", "));
  if (left != used) out += fmt::format("{} of {} alone", keys.empty() ? "" : ",", fmt::join(names, ", "));
  return out;
}

}  // namespace kilvo::cli
