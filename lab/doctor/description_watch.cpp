#include "lab/doctor/description_watch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/core.h>
#include <string_view>
#include <utility>

#include "lab/doctor/examination.hpp"

namespace kilvo::lab {
namespace {

// s of a window after which it is judged. A robot that stands first and then walks shows most by the first, the rest by the last.
constexpr std::array<double, 2> dues{9, 14};
constexpr double least_turned = 0.5;  // rad, below which a window tells nothing of mounts and clocks
constexpr int most_windows = 2;       // of the first ones, in which the robot moved
// Legs and IMU alone: a minute from the first of those on for what they have left open, then, if that is known, one after the other.
constexpr double open_window = 60, later_window = 30;  // s
constexpr double backwards = 1;                        // s: another recording begins
constexpr double lidar_silent = 2;                     // s, after which nothing contradicts legs and IMU

// What the estimator finds and corrects by itself, or only becomes less accurate by, is a warning.
bool spoils(const Finding& finding) {
  constexpr std::array<std::string_view, 31> always{
      "accel_frozen",   "joint_slip",       "joint_fixed",    "joint_names",         "imu_axes",       "imu_rotated",
      "gyro_unit",      "joint_unit",       "joints_swapped", "joint_names_shifted", "joint_sign",     "point_times_reversed",
      "lidar_inverted", "lidar_unit",       "imu_link",       "joint_offset",        "lidar_axes",     "accel_gravity",
      "urdf",           "point_times_unit", "leg_joints",     "sole_unit",           "joint_velocity", "foot_link",
      "joint_frozen",   "joints_repeated",  "gyro_frozen",    "gyro_bias",           "joint_locked",   "lidar_range",
      "clouds_deskewed"};
  constexpr double lidar_turn = 3, imu_turn = 6, time = 0.08, length = 0.2, place = 0.05;  // degrees, s, -, m
  if (std::ranges::find(always, finding.cause) != always.end()) return true;
  if (finding.cause == "accel_unit" || finding.cause == "joints_jump") return finding.fatal;
  if (finding.cause == "lidar_position") return finding.size > place;
  if (finding.cause == "lidar_rotation") return finding.size > lidar_turn;
  if (finding.cause == "imu_mount_rotation") return finding.size > imu_turn;
  if (finding.cause == "leg_lengths") return std::abs(finding.size) > length;
  return finding.cause.ends_with("_clock") && std::abs(finding.size) > time;
}

// The estimator finds a clock that is off by milliseconds as well, but not before it has made the vertical wrong.
bool is_mendable(const Finding& finding) {
  // Legs that are wrong otherwise may fit better with two joints exchanged: that is for a person to decide.
  return !finding.changes.empty() && !finding.cause.ends_with("_rate") && finding.cause != "joints_exchanged";
}

// Most descriptions are right, which a part of the points shows; what seems wrong, or does not show, is judged by all of them.
// `earlier`: of these, when all is right.
Diagnosis diagnosis_of(const Recorded& recorded, const Robot& robot, Earlier& earlier) {
  constexpr std::size_t part = 6;
  const Recorded few = thinned(recorded, part);
  Examination by_few(few, robot, std::move(earlier));
  const Diagnosis first = by_few.run();
  earlier = by_few.for_later();
  const auto unclear = [](const Check& c) { return c.sensor == Sensor::lidar && c.verdict == Check::Verdict::unknown; };
  if (first.findings.empty() && std::ranges::none_of(first.checks, unclear)) return first;
  earlier = {earlier.point_times_are_good, 0, {}, {}};
  return Examination(recorded, robot).run();
}

}  // namespace

WrongDescription as_wrong(const Finding& finding, Time t, double after) {
  return {finding, t, after, spoils(finding), is_mendable(finding)};
}

bool is_refuted(const Finding& finding, const Diagnosis& longer) {
  const auto is_same = [&finding](const Finding& other) { return other.cause == finding.cause; };
  if (std::ranges::any_of(longer.findings, is_same)) return false;
  // The LiDAR is judged against the IMU, whether the legs can be or not.
  const auto is_open = [](const Check& c) { return c.sensor == Sensor::lidar && c.verdict == Check::Verdict::unknown; };
  const bool lidar_is_good = !longer.seems_wrong[index_of(Sensor::lidar)] && std::ranges::none_of(longer.checks, is_open);
  return longer.settled || (finding.sensor == Sensor::lidar && lidar_is_good);
}

void refute(WrongDescription& wrong) {
  wrong.spoils = wrong.is_mendable = false;
  wrong.finding.remedy = "more of the data does not show it, and the description is used as it is";
  wrong.finding.changes.clear();
}

void DescriptionWatch::take(const Measurement& measurement) {
  const Sensor sensor = sensor_of(measurement);
  if (sensor == Sensor::camera) return;
  const std::lock_guard lock(mutex_);
  if (over_) return;
  const Time t = stamp_of(measurement);
  if (sensor == Sensor::lidar) {
    last_lidar_ = t;
    if (phase_ != Phase::first && lidar_is_new_) begin_anew();
  }
  if (phase_ != Phase::first && last_lidar_ && std::abs(to_seconds(t - *last_lidar_)) < lidar_silent) {
    if (now_.begin) now_ = empty();
    return;
  }
  const bool is_another = now_.begin && to_seconds(t - *now_.begin) < -backwards;
  if (is_another) whole_ = empty(), gyro_bias_.reset();
  if (!now_.begin || is_another) begin(t);
  last_ = last_ ? std::max(*last_, t) : t;
  if (const auto* imu = std::get_if<ImuSample>(&measurement)) {
    if (last_imu_) turned_ += imu->gyro.norm() * std::clamp(to_seconds(imu->t - *last_imu_), 0.0, 0.1);
    last_imu_ = imu->t;
  }
  const Window& longest = phase_ == Phase::open && whole_.begin ? whole_ : now_;
  if (to_seconds(t - *longest.begin) > due()) judge(t);
  window_has_lidar_ |= sensor == Sensor::lidar;
  now_.recorder.push(measurement);
  // A robot that stands for long after it has moved shows nothing more, and would fill the memory.
  const bool is_too_long = whole_.begin && to_seconds(t - *whole_.begin) > open_window;
  if (whole_.begin && (last_lidar_ || phase_ == Phase::later || is_too_long)) whole_ = empty();
  if (whole_.begin) whole_.recorder.push(measurement);
}

// A LiDAR that begins late has not been judged.
void DescriptionWatch::begin_anew() {
  if (judging_ != Judging::live) collect();
  now_.begin.reset();
  known_.reset();
  gyro_bias_.reset();
  doubts_.clear();
  phase_ = Phase::first;
  first_ = true;
  windows_ = 0;
}

void DescriptionWatch::begin(Time t) {
  last_ = t;
  if (!origin_) origin_ = t;
  now_ = {Recorder(reading_), t};
  if (windows_ == 0) whole_ = now_;
  turned_ = 0;
  // What a window in which the robot moved has left open needs all of another one.
  due_ = windows_ == 0 ? 0 : dues.size() - 1;
  window_has_lidar_ = false;
  last_imu_.reset();
}

// What single windows have left open is judged by all of them.
bool DescriptionWatch::needs_whole() const { return whole_.begin && !known_ && windows_ > 0 && (phase_ == Phase::open || over_); }

// s of this window after which it is judged.
double DescriptionWatch::due() const { return phase_ == Phase::first ? dues[due_] : phase_ == Phase::open ? open_window : later_window; }

// In a long window a bias of the gyro alone adds up to as much.
bool DescriptionWatch::moved() const { return turned_ > least_turned * std::max(1.0, to_seconds(*last_ - *now_.begin) / dues.back()); }

// One judgement at a time: `live` waits for its turn by going on.
void DescriptionWatch::judge(Time t) {
  constexpr auto at_once = std::chrono::seconds(0);
  if (future_.valid() && judging_ == Judging::live && future_.wait_for(at_once) != std::future_status::ready) return;
  collect();
  if (!known_ && phase_ == Phase::later) {
    over_ = true;
    return;
  }
  if (known_ && phase_ == Phase::first) {
    // Here, and not when it was found, which depends on how fast it was judged.
    phase_ = Phase::later;
    first_ = false;
    const bool is_new = *now_.begin >= *known_ && !window_has_lidar_;
    if (!is_new) begin(t);
    if (!is_new || !over_) return;
  }
  lidar_is_new_ &= !window_has_lidar_;
  bool has_moved = moved();
  if (needs_whole()) {
    now_ = std::exchange(whole_, empty());
    has_moved = true;  // in a window before
  }
  if (first_ || has_moved) {
    auto work = [robot = robot_, recorder = now_.recorder, begin = *now_.begin, t, earlier = std::move(earlier_)]() mutable {
      const Recorded recorded = recorder.finish();
      const Diagnosis diagnosis = diagnosis_of(recorded, robot, earlier);
      return Verdict{diagnosis.findings, diagnosis.settled, std::move(earlier), begin, t, diagnosis.gyro_bias};
    };
    future_ = std::async(judging_ == Judging::here ? std::launch::deferred : std::launch::async, std::move(work));
    if (judging_ == Judging::here) collect();
  }
  if (phase_ == Phase::first && ++due_ < dues.size()) return;
  first_ = false;
  if (has_moved) {
    ++windows_;
    if (phase_ == Phase::open) phase_ = Phase::later;
    if (phase_ == Phase::first && windows_ >= most_windows) phase_ = Phase::open;
  }
  begin(t);
}

// What seems to be wrong may be something else that has changed: no setting corrects it.
WrongDescription DescriptionWatch::as_changed(WrongDescription wrong, Time begin) const {
  wrong.has_changed = true;
  wrong.is_mendable = false;
  wrong.finding.changes.clear();
  wrong.finding.text =
      fmt::format("from {:.0f} to {:.0f} s of data, and not before: {}", to_seconds(begin - *origin_), wrong.after, wrong.finding.text);
  const std::string& remedy = wrong.finding.remedy;
  wrong.finding.remedy =
      "look for what has failed, slipped or been reset in that time" + (remedy.empty() ? "" : ", or was not seen before: " + remedy);
  return wrong;
}

// Legs never correct the heading: on them and the IMU alone nothing else would show it.
void DescriptionWatch::compare_gyro_bias(Verdict& verdict) {
  if (!verdict.gyro_bias) return;
  if (!gyro_bias_) gyro_bias_ = verdict.gyro_bias;
  const double change = verdict.gyro_bias->first - gyro_bias_->first, sigma = std::hypot(verdict.gyro_bias->second, gyro_bias_->second);
  constexpr double warms_up = 0.015;  // rad/s
  if (std::abs(change) < std::max(warms_up, sure * sigma)) return;
  Finding f{Sensor::imu, "gyro_bias", {}, {}, {}, change, "rad/s", {}, true};
  f.text = fmt::format("the gyro's bias about the vertical has changed by {:.3f} rad/s, by which the heading turns", change);
  f.evidence = fmt::format("soles that stand turn by {:.3f} rad/s otherwise than the gyro, standard deviation {:.3f}, and by {:.3f} before",
                           verdict.gyro_bias->first, verdict.gyro_bias->second, gyro_bias_->first);
  f.remedy = "the gyro: its supply, its temperature, or a driver that subtracts a bias of its own";
  verdict.findings.push_back(std::move(f));
}

void DescriptionWatch::collect() {
  if (!future_.valid()) return;
  Verdict verdict = future_.get();
  compare_gyro_bias(verdict);
  earlier_ = std::move(verdict.earlier);
  std::vector<Doubt> doubts;
  for (const Finding& finding : verdict.findings) {
    WrongDescription wrong = as_wrong(finding, verdict.t, to_seconds(verdict.t - *origin_));
    wrong.has_changed = finding.cause == "joint_slip" || finding.cause == "gyro_bias";
    if (known_) {
      // A window among many may err: the next one must show it as well, but for sensors that repeat themselves, which none does by chance.
      const auto before = std::ranges::find(doubts_, finding.cause, &Doubt::cause);
      doubts.push_back({finding.cause, before != doubts_.end() ? before->begin : verdict.begin});
      constexpr double by_no_chance = 0.03;  // rad/s
      const bool is_sure = finding.cause.ends_with("_frozen") || finding.cause == "joint_slip" ||
                           (finding.cause == "gyro_bias" && std::abs(finding.size) > by_no_chance);
      wrong.spoils &= before != doubts_.end() || is_sure;
      wrong = as_changed(std::move(wrong), doubts.back().begin);
    }
    const auto same = [&wrong](const WrongDescription& w) {
      return w.finding.cause == wrong.finding.cause && (w.spoils || !w.has_changed || !wrong.spoils);
    };
    if (std::ranges::none_of(found_, same)) found_.push_back(std::move(wrong));
  }
  doubts_ = std::move(doubts);
  if (verdict.known && !known_) known_ = verdict.t;
}

std::vector<WrongDescription> DescriptionWatch::news() {
  const std::lock_guard lock(mutex_);
  if (future_.valid() && future_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) collect();
  std::vector<WrongDescription> out(found_.begin() + static_cast<std::ptrdiff_t>(told_), found_.end());
  told_ = found_.size();
  return out;
}

std::vector<WrongDescription> DescriptionWatch::finish() {
  const std::lock_guard lock(mutex_);
  collect();
  // A recording that ends before is judged by what there is; a last window that is short tells less than those before it.
  if (std::exchange(over_, true)) return found_;
  if (now_.begin && last_ && (first_ || needs_whole() || to_seconds(*last_ - *now_.begin) > dues.front())) {
    judge(*last_);
    collect();
  }
  return found_;
}

}  // namespace kilvo::lab
