#include <algorithm>
#include <fmt/core.h>
#include <limits>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "lab/settings/setting_list.hpp"

namespace kilvo::lab {
namespace {

constexpr double any = std::numeric_limits<double>::infinity();

constexpr Range up_to(double high) { return {0, high, false}; }
constexpr Range another_epoch{-4e9, 4e9};  // s: from the time since a boot to that since 1970
constexpr Range above_zero(double high = any) { return {0, high, true}; }

// One line per number. Upper limits are where a mistyped unit or a number that no code was made for begins.
constexpr std::pair<std::string_view, Range> ranges[] = {
    {"imu.rate", above_zero(100000)},
    {"imu.time_offset", another_epoch},
    {"imu.accel_range", up_to(10000)},
    {"imu.gyro_range", up_to(1000)},
    {"imu.gyro_scale", {0.5, 2}},
    {"imu.gyro_noise", above_zero(1000)},
    {"imu.accel_noise", above_zero(10000)},
    {"imu.velocity_noise", up_to(1000)},
    {"imu.gyro_bias_walk", up_to(1000)},
    {"imu.accel_bias_walk", up_to(10000)},
    {"legs.rate", above_zero(100000)},
    {"legs.time_offset", another_epoch},
    {"legs.sole_offset", {-1, 1}},
    {"legs.velocity_sigma", {1e-4, 10}},
    {"legs.vertical_velocity_sigma", {1e-4, 10}},
    {"legs.velocity_correlation", up_to(1)},
    {"legs.position_sigma", {1e-5, 1}},
    {"legs.position_correlation", up_to(1)},
    {"legs.ground_sigma", above_zero(1)},
    {"legs.entry_delay", up_to(1)},
    {"legs.gate", above_zero()},
    {"legs.iterations", {1, 100}},
    {"estimator.smooth_time", above_zero(60)},
    {"live.max_latency", above_zero(10)},
    {"live.priority", {-1, 99}},
    {"live.fast_core", {-1, 1023}},
    {"live.slow_core", {-1, 1023}},
    {"live.tf_rate", {1, 1000}},
    {"legs.foot_noise", up_to(10)},
    {"legs.foot_noise_vertical", up_to(10)},
    {"lidar.rate", above_zero(1000)},
    {"lidar.time_offset", another_epoch},
    {"lidar.min_range", up_to(1000)},
    {"lidar.max_range", above_zero(10000)},
    {"lidar.range_noise", above_zero(10)},
    {"lidar.angle_noise", up_to(1)},
    {"lidar.voxel_size", {0.01, 25}},
    {"lidar.gate", above_zero()},
    {"lidar.weak_share", up_to(1)},
    {"camera.rate", above_zero(1000)},
    {"camera.time_offset", another_epoch},
    {"camera.width", {1, 20000}},
    {"camera.height", {1, 20000}},
    {"camera.fx", above_zero(1000000)},
    {"camera.fy", above_zero(1000000)},
    {"camera.cx", {-20000, 40000}},
    {"camera.cy", {-20000, 40000}},
    {"camera.cell", {8, 512}},
    {"camera.read_noise", above_zero(255)},
    {"camera.shot_noise", up_to(255)},
    {"camera.pixel_error", up_to(10)},
    {"camera.bias_share", above_zero(1)},
    {"camera.min_corner", above_zero()},
    {"camera.min_correlation", {-1, 1}},
    {"camera.gate", above_zero()},
    {"camera.exposure_walk", up_to(any)},
    {"map.voxel_size", {0.04, 100}},
    {"map.min_points", {3, any}},
    {"map.max_roughness", above_zero()},
    {"map.full_points", {3, any}},
    {"map.radius", above_zero(10000)},
    {"map.max_nodes", {1000, 100000000}},
    {"map.resolution", {0.001, 100}},
    {"map.max_points", {0, 1000000000}},
    {"map.visual.voxel_size", {0.05, 100}},
    {"map.visual.points_per_voxel", {1, 1000}},
    {"map.visual.max_points", {1, 10000000}},
    {"estimator.max_wait", up_to(60)},
    {"estimator.max_imu_gap", above_zero(60)},
    {"estimator.threads", {0, 1024}},
    {"estimator.initial.still_time", above_zero(60)},
    {"estimator.initial.moving_start", above_zero(600)},
    {"estimator.initial.still_gyro", above_zero()},
    {"estimator.initial.still_accel", above_zero()},
    {"estimator.initial.gravity_sigma", above_zero()},
    {"estimator.initial.gyro_bias_sigma", above_zero()},
    {"estimator.initial.velocity_sigma", above_zero()},
    {"estimator.update.max_iterations", {1, 100}},
    {"estimator.update.rotation_step", above_zero()},
    {"estimator.update.position_step", above_zero()},
};

}  // namespace

std::string Range::text() const {
  if (low == -any) return high == any ? "any" : fmt::format("at most {}", high);
  std::string lower = fmt::format("{} {}", without_low ? "above" : "at least", low);
  if (high == any) return lower;
  return without_low ? fmt::format("{}, at most {}", lower, high) : fmt::format("{} to {}", low, high);
}

std::optional<Range> range_of(std::string_view key) {
  const auto* found = std::ranges::find(ranges, key, &std::pair<std::string_view, Range>::first);
  if (found == std::end(ranges)) return std::nullopt;
  return found->second;
}

const std::vector<std::string>& choices_of(std::string_view key) {
  static const std::vector<std::string> none;
  static const std::map<std::string_view, std::vector<std::string>> table{
      {"legs.type", {"joints", "feet"}},
      {"legs.velocities", {"messages", "positions"}},
      {"legs.clock", {"stamp", "arrival", "estimated"}},
      {"legs.contact", {"kilvo", "paper", "variance", "force"}},
      {"estimator.settling", {"legs", "none"}},
      {"legs.adaptation", {"foot", "row", "none"}},
      {"legs.height", {"ki", "always", "never"}},
      {"legs.ground", {"map", "contacts"}},
      {"camera.model", {"pinhole_radtan", "equidistant"}},
  };
  const auto found = table.find(key);
  return found == table.end() ? none : found->second;
}

}  // namespace kilvo::lab
