#include "apps/cli/description_watch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "lab/doctor/examination.hpp"

namespace kilvo::cli {
namespace {

constexpr double watched = 14;  // s

}  // namespace

void DescriptionWatch::take(const Measurement& measurement) {
  if (judged_ || sensor_of(measurement) == Sensor::camera) return;
  const Time t = stamp_of(measurement);
  if (!begin_) begin_ = t;
  if (to_seconds(t - *begin_) > watched) return judge();
  recorder_.push(measurement);
}

void DescriptionWatch::judge() {
  judged_ = true;
  const auto work = [robot = robot_, recorded = recorder_.finish()] { return lab::Examination(recorded, robot).run().findings; };
  future_ = std::async(beside_ ? std::launch::async : std::launch::deferred, work);
}

const std::vector<lab::Finding>& DescriptionWatch::findings() {
  // A recording that ends before is judged by what there is.
  if (!judged_) judge();
  if (future_.valid()) findings_ = future_.get();
  return findings_;
}

bool DescriptionWatch::spoils(const lab::Finding& finding) {
  constexpr std::array<std::string_view, 11> always{"imu_axes",       "imu_rotated",         "gyro_unit",  "joint_unit",
                                                    "joints_swapped", "joint_names_shifted", "joint_sign", "point_times_reversed",
                                                    "lidar_inverted", "lidar_unit",          "imu_link"};
  // What the estimator finds and corrects by itself, or only becomes less accurate by, is a warning.
  constexpr double lidar_turn = 3, imu_turn = 10, distance = 0.3, time = 0.08;  // degrees, m, s
  if (std::ranges::find(always, finding.cause) != always.end()) return true;
  if (finding.cause == "accel_unit") return finding.fatal;
  if (finding.cause == "lidar_rotation") return finding.size > lidar_turn;
  if (finding.cause == "imu_mount_rotation") return finding.size > imu_turn;
  if (finding.cause == "lidar_position") return finding.size > distance;
  return finding.cause.ends_with("_clock") && std::abs(finding.size) > time;
}

}  // namespace kilvo::cli
