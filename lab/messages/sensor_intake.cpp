#include "lab/messages/sensor_intake.hpp"

#include <algorithm>
#include <cmath>

#include "lab/messages/message_decoder.hpp"
#include "lab/messages/plural.hpp"

namespace kilvo::lab {
namespace {

// Stamps that scatter by less are everyday, s.
constexpr double remarkable_scatter = 1e-3;

// A driver that has no such values may fill them with NaN.
void clear_unknown(std::vector<double>& values) {
  if (std::ranges::none_of(values, [](double v) { return std::isfinite(v); })) values.clear();
}

Time& stamp_in(Measurement& measurement) {
  return std::visit([](auto& m) -> Time& { return m.t; }, measurement);
}

}  // namespace

std::optional<Measurement> SensorIntake::take(Sensor sensor, std::string_view type, const WireMessage& message, Time arrived,
                                              const PointTimeFormat& point_time) {
  auto decoded = decode_measurement(sensor, type, message, point_time, with_colours_, joint_names_);
  if (!decoded) {
    newest_fault_ = decoded.reason();
    if (first_fault_.empty()) first_fault_ = newest_fault_;
    ++counts_.dropped["undecodable"];
    return std::nullopt;
  }
  newest_fault_.clear();
  ++counts_.used;
  tick_ = decoded->tick;
  gyro_ = decoded->gyro;
  counts_.absurd_point_times += decoded->absurd_times;
  if (auto* joints = std::get_if<JointSample>(&decoded->measurement)) {
    joint_names_ = joints->names;
    clear_unknown(joints->velocity);
    clear_unknown(joints->effort);
  }
  if (auto* imu = std::get_if<ImuSample>(&decoded->measurement)) imu->gyro = imu->gyro.cwiseProduct(gyro_scale_);
  Time& stamp = stamp_in(decoded->measurement);
  if (stamp == Time{}) {
    // A driver that does not stamp, as some do not their joints: the time of arrival is the best there is, of the last point of a sweep.
    stamp = arrived;
    if (const auto* scan = std::get_if<LidarScan>(&decoded->measurement)) stamp -= Duration(offsets_of(*scan).last);
    ++counts_.unstamped;
  }
  stamp += from_seconds(time_offset_);
  if (const auto* imu = std::get_if<ImuSample>(&decoded->measurement)) {
    // A message that comes twice is none that was measured later.
    const bool is_repeated = newest_imu_ && newest_imu_->t == imu->t && newest_imu_->gyro == imu->gyro && newest_imu_->accel == imu->accel;
    newest_imu_ = *imu;
    if (!is_repeated) imu_stamp_ = even_samples_.follow(stamp);
    stamp = imu_stamp_;
  }
  if (auto* scan = std::get_if<LidarScan>(&decoded->measurement)) {
    const std::size_t repeated = repeated_.take_out(*scan);
    counts_.repeated_points += repeated;
    if (repeated > 0 && scan->points.empty()) {
      take_back("repeated");
      return std::nullopt;
    }
    const OffsetRange offsets = offsets_of(*scan);
    stamp = even_sweeps_.follow(stamp, stamp + Duration(offsets.first), stamp + Duration(offsets.last));
  }
  if (const double scatter = even_sweeps_.scatter().value_or(0); scatter > remarkable_scatter) scatter_ = scatter;
  if (even_samples_.lateness()) lateness_ = *even_samples_.lateness();
  auto* joints = std::get_if<JointSample>(&decoded->measurement);
  if (joints == nullptr) return std::move(decoded->measurement);
  auto whole = assembly_.join(std::move(*joints), arrived);
  counts_.unused_parts = assembly_.unused();
  if (!whole && !assembly_.is_of_legs()) take_back("no joint of the legs");
  if (!whole) return std::nullopt;
  return *std::move(whole);
}

std::vector<std::string> SensorIntake::findings() const {
  std::vector<std::string> texts;
  if (counts_.absurd_point_times > 0) {
    texts.push_back(plural(counts_.absurd_point_times, "point") + " dropped, whose time is not within 2 s of the stamp");
  }
  if (counts_.repeated_points > 0) {
    texts.push_back("clouds repeat points of the one before: " + plural(counts_.repeated_points, "point") +
                    " used once; the driver should publish one scan in each message");
  }
  if (scatter_ > 0) {
    texts.push_back(
        "stamps scatter by " + std::to_string(1e3 * scatter_) +
        " ms, and sweeps begin before the last has ended: the times of a line through them are used; the driver should stamp by "
        "the sensor's clock");
  }
  if (lateness_ > 0) {
    texts.push_back("samples come in bursts with stamps that are late by " + std::to_string(1e3 * lateness_) +
                    " ms in the mean: even times are used; the driver should stamp by the sensor's clock");
  }
  return texts;
}

}  // namespace kilvo::lab
