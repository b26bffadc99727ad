#include "lab/messages/sensor_intake.hpp"

#include "lab/messages/message_decoder.hpp"

namespace kilvo::lab {
namespace {

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
  if (const auto* joints = std::get_if<JointSample>(&decoded->measurement)) joint_names_ = joints->names;
  if (auto* imu = std::get_if<ImuSample>(&decoded->measurement)) imu->gyro = imu->gyro.cwiseProduct(gyro_scale_);
  Time& stamp = stamp_in(decoded->measurement);
  if (stamp == Time{}) {
    // A driver that does not stamp, as some do not their joints: the time of arrival is the best there is.
    stamp = arrived;
    ++counts_.unstamped;
  }
  stamp += from_seconds(time_offset_);
  if (auto* scan = std::get_if<LidarScan>(&decoded->measurement)) {
    const std::size_t repeated = repeated_.take_out(*scan);
    counts_.repeated_points += repeated;
    if (repeated > 0 && scan->points.empty()) {
      take_back("repeated");
      return std::nullopt;
    }
  }
  auto* joints = std::get_if<JointSample>(&decoded->measurement);
  if (joints == nullptr) return std::move(decoded->measurement);
  auto whole = assembly_.join(std::move(*joints), arrived);
  counts_.unused_parts = assembly_.unused();
  if (!whole && !assembly_.is_of_legs()) take_back("no joint of the legs");
  if (!whole) return std::nullopt;
  return *std::move(whole);
}

}  // namespace kilvo::lab
