// Clocks: those that step, and one of a sensor that is not the IMU's.
#include <algorithm>
#include <cmath>
#include <string>

#include "kilvo/estimator/decimals.hpp"
#include "kilvo/estimator/estimator.hpp"

namespace kilvo {
namespace {

// Offsets below are of no consequence, or a model's error; once there is one, it is found as exactly as the data allows, s.
constexpr double worth_moving = 2e-3, worth_refining = 5e-4;

}  // namespace

void Estimator::note_clock_step() {
  statistics_.clock_steps = clock_steps_.count();
  const double back = to_seconds(clock_steps_.last());
  report(Sensor::imu, Reason::imu_clock_stepped, std::abs(back), back > 0 ? "back" : "ahead");
}

void Estimator::shift(Measurement& m) const {
  const Duration by = shift_[static_cast<std::size_t>(sensor_of(m))];
  if (auto* scan = std::get_if<LidarScan>(&m)) scan->t += by;
  if (auto* image = std::get_if<CameraImage>(&m)) image->t += by;
}

double Estimator::least_offset(Sensor s) const {
  return shift_[static_cast<std::size_t>(s)] == Duration(0) ? worth_moving : worth_refining;
}

// A sweep that lasted from `begin` to `end` turned the state from `prior` to what it is.
void Estimator::check_lidar_clock(const Estimate& prior, Time begin, Time end) {
  const auto first = trajectory_.at(begin), last = trajectory_.at(end);
  if (!first || !last || end <= begin || !unobservable_.isZero(0) || recovery_.sweeps_to_go > 0) return;
  const Eigen::Vector3d rate = (first->R.inverse() * last->R).Log() / to_seconds(end - begin);
  lidar_clock_.add((prior.x.R.inverse() * estimate_->x.R).Log(), rate);
  if (lidar_clock_.is_doubtful()) mount_check_ = MountCheck();  // it may see nothing but this
  const auto offset = lidar_clock_.offset(least_offset(Sensor::lidar));
  if (!offset) return;
  lidar_clock_.restart();
  move_clock(Sensor::lidar, *offset);
}

// What the images say of the mount and of the clock, they say of views that were taken by the clock as it was.
void Estimator::check_camera_clock() {
  const auto offset = mount_check_.time_offset(least_offset(Sensor::camera));
  if (!offset) return;
  mount_check_ = MountCheck();
  visual_map_ = VisualMap(config_.visual_map);
  move_clock(Sensor::camera, *offset);
}

void Estimator::move_clock(Sensor sensor, double by) {
  constexpr double longest = 0.2;  // s
  const auto s = static_cast<std::size_t>(sensor);
  const double configured = sensor == Sensor::lidar ? robot_.lidar.time_offset : robot_.camera.time_offset;
  const double total = std::clamp(to_seconds(shift_[s]) + by, -longest, longest);
  shift_[s] = from_seconds(total);
  statistics_.clock_shift[s] = total;
  const std::string name = name_of(sensor);
  report(sensor, Reason::clock_offset, total, name + ".time_offset to " + decimals(configured + total, 4));
}

}  // namespace kilvo
