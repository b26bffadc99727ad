#include "lab/doctor/recorded.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

namespace kilvo::lab {
namespace {

constexpr std::size_t points_of_a_sweep = 6000;
constexpr double leg_period = 0.0039;  // s
constexpr double leg_step = 0.03;      // s between two stamps of a clock that the program finds
constexpr float nearest_point = 0.5F;  // m: nearer points may be the robot's own arms

// Another publisher may have another order, and more joints. None: it has not all of these.
std::optional<std::vector<double>> in_order(const JointSample& sample, const std::vector<std::string>& names) {
  std::vector<double> out;
  for (const std::string& name : names) {
    const auto i = static_cast<std::size_t>(std::ranges::find(sample.names, name) - sample.names.begin());
    if (i >= sample.position.size()) return std::nullopt;
    out.push_back(sample.position[i]);
  }
  return out.empty() ? std::nullopt : std::optional(std::move(out));
}

}  // namespace

Recorded thinned(Recorded recorded, std::size_t step) {
  for (Sweep& sweep : recorded.sweeps) {
    std::vector<TimedPoint> few;
    few.reserve(sweep.points->size() / step + 1);
    for (std::size_t i = 0; i < sweep.points->size(); i += step) few.push_back((*sweep.points)[i]);
    sweep.points = std::make_shared<const std::vector<TimedPoint>>(std::move(few));
  }
  return recorded;
}

double Recorder::seconds(Time t) {
  if (!begun_) recorded_.origin = to_ns(t);
  begun_ = true;
  return 1e-9 * static_cast<double>(to_ns(t) - recorded_.origin);
}

void Recorder::push(const Measurement& measurement) {
  const double t = seconds(stamp_of(measurement));
  times_[static_cast<std::size_t>(sensor_of(measurement))].push_back(t);
  std::visit([this](const auto& m) { take(m); }, measurement);
}

void Recorder::take(const ImuSample& sample) {
  const bool is_running = !sample.gyro.isZero(0) || !sample.accel.isZero(0);
  if (is_running && sample.gyro.allFinite() && sample.accel.allFinite())
    recorded_.imu.push_back({seconds(sample.t), sample.gyro, sample.accel});
}

// From the message before the last to the last one, and there since.
void Recorder::note_steps(double t, const std::vector<double>& positions) {
  constexpr double jump = 0.1, faster_than_any = 40;  // rad, rad/s
  constexpr std::size_t most = 16, fewest_others = 3;
  const auto& [first, middle] = before_;
  std::vector<JointStep> steps;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    // One that turns on and on is a turn further.
    const double there = std::remainder(middle.position[i] - first.position[i], 2 * std::numbers::pi),
                 on = positions[i] - middle.position[i];
    const bool is_fast = std::abs(there) > faster_than_any * std::max(middle.t - first.t, (t - first.t) / 2);
    // A joint that turns the other way round from now on is another mistake.
    const bool is_mirrored = std::abs(middle.position[i] + first.position[i]) < 0.25 * std::abs(there);
    const bool is_step = std::abs(there) >= jump && is_fast && !is_mirrored && std::abs(on) < 0.25 * std::abs(there);
    if (is_step) steps.push_back({middle.t, i, there});
  }
  // All at once are of a driver that begins, or of another robot.
  constexpr std::size_t at_once = 2;
  if (steps.size() > at_once || positions.size() < at_once + fewest_others) return;
  for (const JointStep& step : steps) {
    if (recorded_.joint_steps.size() < most) recorded_.joint_steps.push_back(step);
  }
}

void Recorder::count_return(double t, const std::vector<double>& positions) {
  constexpr double at_once = 0.03, jump = 0.1;  // s, rad: 900 rad/s^2 and more
  ++recorded_.joint_messages;
  if (recorded_.joint_returns.size() < positions.size()) recorded_.joint_returns.resize(positions.size());
  auto& [first, middle] = before_;
  const bool comparable = first.position.size() == positions.size() && middle.position.size() == positions.size();
  // A message that is late shows where the joints were.
  const bool is_in_time = first.t <= middle.t && middle.t <= t && t - first.t < at_once;
  for (std::size_t i = 0; comparable && is_in_time && i < positions.size(); ++i) {
    const double there = middle.position[i] - first.position[i], back = positions[i] - middle.position[i];
    const double size = std::min(std::abs(there), std::abs(back));
    if (!(size >= jump && std::abs(there + back) <= 0.25 * size)) continue;
    JointReturns& returns = recorded_.joint_returns[i];
    ++returns.count;
    returns.largest = std::max(returns.largest, size);
  }
  if (comparable && is_in_time) note_steps(t, positions);
  std::swap(first, middle);
  middle.t = t;
  middle.position = positions;
}

void Recorder::take(const JointSample& sample) {
  const double t = seconds(sample.t);
  if (sample.names.list() == recorded_.joint_names) {
    count_return(t, sample.position);
  } else if (const auto ordered = in_order(sample, recorded_.joint_names)) {
    count_return(t, *ordered);
  }
  if (t - last_leg_ < leg_period && (t >= last_leg_ || (recorded_.reading.leg_clock_is_found && t > last_leg_ - leg_step))) return;
  if (!std::ranges::all_of(sample.position, [](double q) { return std::isfinite(q); })) return;
  if (recorded_.joint_names.empty()) recorded_.joint_names = sample.names;
  if (sample.names.list() != recorded_.joint_names) return;
  // Before a clock is found, or once another one is, the stamps are off by something else: only what follows can be judged.
  if (recorded_.reading.leg_clock_is_found && std::abs(t - last_leg_ - leg_period) > leg_step) recorded_.legs.clear();
  last_leg_ = t;
  recorded_.legs.push_back({t, sample.position, sample.velocity});
}

void Recorder::take(const LidarScan& scan) {
  if (scan.points.empty()) return;
  Sweep sweep;
  sweep.t = seconds(scan.t);
  const std::size_t step = recorded_.reading.all_points ? 1 : std::max<std::size_t>(1, scan.points.size() / points_of_a_sweep);
  std::vector<TimedPoint> points;
  points.reserve(scan.points.size() / (step | 1U) + 1);
  // A step that shares no factor with the number of lines, so that no line is left out.
  for (std::size_t i = 0; i < scan.points.size(); i += step | 1U) {
    const LidarPoint& p = scan.points[i];
    const Eigen::Vector3f x(p.x, p.y, p.z);
    const float range = x.norm();
    if (std::isfinite(range) && range > 0) {
      ++recorded_.points;
      recorded_.far_points += range > far_away ? 1 : 0;
    }
    if (!(range > nearest_point && range < 200)) continue;
    points.push_back({x, 1e-9F * static_cast<float>(p.offset_ns)});
  }
  if (points.size() < 50) return;
  const auto [low, high] = std::ranges::minmax(points, {}, &TimedPoint::t);
  sweep.begin = sweep.t + static_cast<double>(low.t);
  sweep.end = sweep.t + static_cast<double>(high.t);
  sweep.points = std::make_shared<const std::vector<TimedPoint>>(std::move(points));
  recorded_.sweeps.push_back(std::move(sweep));
}

void Recorder::take(const CameraImage& image) {
  if (image.image.empty()) return;
  recorded_.image_width = image.image.width;
  recorded_.image_height = image.image.height;
  if (auto pair = tracker_.push(seconds(image.t), image.image)) recorded_.tracks.push_back(*std::move(pair));
}

Recorded Recorder::finish() {
  const auto by_time = [](const auto& a, const auto& b) { return a.t < b.t; };
  std::ranges::stable_sort(recorded_.imu, by_time);
  std::ranges::stable_sort(recorded_.legs, by_time);
  std::ranges::stable_sort(recorded_.sweeps, by_time);
  for (std::size_t s = 0; s < sensor_count; ++s) {
    std::vector<double>& t = times_[s];
    std::ranges::sort(t);
    const auto median_step = [&t](std::size_t apart) {
      std::vector<double> steps;
      for (std::size_t i = apart; i < t.size(); ++i) steps.push_back((t[i] - t[i - apart]) / static_cast<double>(apart));
      const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
      std::ranges::nth_element(steps, middle);
      return *middle;
    };
    recorded_.stamps[s].count = t.size();
    if (t.size() < 2) continue;
    // Stamps in bursts make single steps too short, missing messages make long ones too long.
    constexpr double in_bursts = 3;
    const double single = median_step(1), several = median_step(std::min<std::size_t>(200, t.size() / 2));
    recorded_.stamps[s].period = several > in_bursts * single ? several : single;
  }
  return std::move(recorded_);
}

}  // namespace kilvo::lab
