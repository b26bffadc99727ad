#include "lab/doctor/description_watch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "lab/doctor/examination.hpp"

namespace kilvo::lab {
namespace {

// s of a window after which it is judged. A robot that stands first and then walks shows most by the first, the rest by the last.
constexpr std::array<double, 2> dues{9, 14};
constexpr double least_turned = 0.5;  // rad, below which a window tells nothing of mounts and clocks
constexpr int most_windows = 2;       // in which the robot moved: what they leave open stays open
constexpr double backwards = 1;       // s: another recording begins

// What the estimator finds and corrects by itself, or only becomes less accurate by, is a warning.
bool spoils(const Finding& finding) {
  constexpr std::array<std::string_view, 26> always{"imu_axes",       "imu_rotated",         "gyro_unit",      "joint_unit",
                                                    "joints_swapped", "joint_names_shifted", "joint_sign",     "point_times_reversed",
                                                    "lidar_inverted", "lidar_unit",          "imu_link",       "joint_offset",
                                                    "lidar_axes",     "accel_gravity",       "urdf",           "point_times_unit",
                                                    "leg_joints",     "sole_unit",           "joint_velocity", "foot_link",
                                                    "joint_frozen",   "joints_repeated",     "gyro_frozen",    "joint_locked",
                                                    "lidar_range",    "clouds_deskewed"};
  constexpr double lidar_turn = 3, imu_turn = 10, time = 0.08, length = 0.2, place = 0.05;  // degrees, s, -, m
  if (std::ranges::find(always, finding.cause) != always.end()) return true;
  if (finding.cause == "accel_unit") return finding.fatal;
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
  if (!begin_ || to_seconds(t - *begin_) < -backwards) begin(t);
  last_ = last_ ? std::max(*last_, t) : t;
  if (const auto* imu = std::get_if<ImuSample>(&measurement)) {
    if (last_imu_) turned_ += imu->gyro.norm() * std::clamp(to_seconds(imu->t - *last_imu_), 0.0, 0.1);
    last_imu_ = imu->t;
  }
  if (to_seconds(t - *begin_) > dues[due_]) {
    judge(t);
    if (over_) return;
  }
  recorder_.push(measurement);
}

void DescriptionWatch::begin(Time t) {
  begin_ = last_ = t;
  if (!origin_) origin_ = t;
  recorder_ = Recorder(reading_);
  // What a window in which the robot moved has left open needs all of another one.
  due_ = windows_ == 0 ? 0 : dues.size() - 1;
  turned_ = 0;
  last_imu_.reset();
}

bool DescriptionWatch::moved() const { return turned_ > least_turned; }

// One judgement at a time: `live` waits for its turn by going on.
void DescriptionWatch::judge(Time t) {
  constexpr auto at_once = std::chrono::seconds(0);
  if (future_.valid() && judging_ == Judging::live && future_.wait_for(at_once) != std::future_status::ready) return;
  collect();
  if (over_) return;
  if (first_ || moved()) {
    auto work = [robot = robot_, recorder = recorder_, t, earlier = std::move(earlier_)]() mutable {
      const Recorded recorded = recorder.finish();
      const Diagnosis diagnosis = diagnosis_of(recorded, robot, earlier);
      return Verdict{diagnosis.findings, diagnosis.settled, std::move(earlier), t};
    };
    future_ = std::async(judging_ == Judging::here ? std::launch::deferred : std::launch::async, std::move(work));
    if (judging_ == Judging::here) collect();
  }
  if (++due_ < dues.size()) return;
  first_ = false;
  if (moved()) ++windows_;
  begin(t);
}

void DescriptionWatch::collect() {
  if (!future_.valid()) return;
  Verdict verdict = future_.get();
  over_ = verdict.known || windows_ >= most_windows;
  earlier_ = std::move(verdict.earlier);
  for (const Finding& finding : verdict.findings) {
    const auto same = [&finding](const WrongDescription& w) { return w.finding.cause == finding.cause; };
    if (std::ranges::none_of(found_, same)) found_.push_back(as_wrong(finding, verdict.t, to_seconds(verdict.t - *origin_)));
  }
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
  if (!over_ && last_ && (first_ || to_seconds(*last_ - *begin_) > dues.front())) {
    judge(*last_);
    collect();
  }
  over_ = true;
  return found_;
}

}  // namespace kilvo::lab
