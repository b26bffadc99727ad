#include "apps/ros1/sensor_inputs.hpp"

#include <fmt/core.h>
#include <ros/ros.h>

#include "apps/ros1/ros_messages.hpp"
#include "lab/messages/message_decoder.hpp"

namespace kilvo::ros1 {
namespace {

constexpr std::uint32_t most_samples = 2000, most_pictures = 20;  // messages that wait for their thread
// Images that come compressed are left out while the same come uncompressed.
constexpr auto raw_is_near = std::chrono::seconds(1);

bool is_quick(Sensor sensor) { return sensor == Sensor::imu || sensor == Sensor::legs; }

double offset_of(const Robot& robot, Sensor sensor) {
  const double offsets[] = {robot.imu.time_offset, robot.legs.time_offset, robot.lidar.time_offset, robot.camera.time_offset};
  return offsets[static_cast<std::size_t>(sensor)];
}

std::string accepted_text(Sensor sensor) {
  std::string text;
  for (const auto type : lab::accepted_types(sensor)) text += fmt::format("{}{}", text.empty() ? "" : " or ", type);
  return text;
}

}  // namespace

SensorInputs::SensorInputs(const lab::Settings& settings, bool no_deskew, Sink sink)
    : sink_(std::move(sink)), lidar_rate_(settings.robot.lidar.rate), fast_spinner_(1, &fast_queue_), slow_spinner_(1, &slow_queue_) {
  if (no_deskew) point_time_.emplace();
  for (int i = 0; i < sensor_count; ++i) {
    if (settings.has(static_cast<Sensor>(i))) subscribe(static_cast<Sensor>(i), settings);
  }
  fast_spinner_.start();
  slow_spinner_.start();
}

void SensorInputs::stop() {
  fast_spinner_.stop();
  slow_spinner_.stop();
  for (Input& input : inputs_) {
    input.subscriber.shutdown();
    input.compressed.shutdown();
  }
}

void SensorInputs::subscribe(Sensor sensor, const lab::Settings& settings) {
  Input& input = inputs_[static_cast<std::size_t>(sensor)];
  input.topic = settings.topic(sensor);
  input.intake = lab::SensorIntake(offset_of(settings.robot, sensor));
  const auto to = [&](const std::string& topic, bool is_compressed) {
    const boost::function<void(const Event&)> callback = [this, sensor, is_compressed](const Event& event) {
      receive(sensor, is_compressed, event);
    };
    ros::SubscribeOptions options;
    options.initByFullCallbackType<const Event&>(topic, is_quick(sensor) ? most_samples : most_pictures, callback);
    options.transport_hints = ros::TransportHints().tcpNoDelay();
    options.callback_queue = is_quick(sensor) ? &fast_queue_ : &slow_queue_;
    return node_.subscribe(options);
  };
  input.subscriber = to(input.topic, false);
  if (sensor == Sensor::camera && !input.topic.ends_with("/compressed"))
    input.compressed = to(fmt::format("{}/compressed", input.topic), true);
}

void SensorInputs::receive(Sensor sensor, bool is_compressed, const Event& event) {
  Input& input = inputs_[static_cast<std::size_t>(sensor)];
  const std::string& type = event.getConnectionHeader()["type"];
  {
    const std::lock_guard lock(input.mutex);
    const auto now = SteadyClock::now();
    if (is_compressed && input.raw_last && now - *input.raw_last < raw_is_near) return;
    if (!is_compressed) input.raw_last = now;
    ++input.messages;
    input.last = now;
  }
  if (!lab::is_type_of(sensor, type)) {
    complain(input, fmt::format("its type is {}, but the sensor {} needs {}", type, name_of(sensor), accepted_text(sensor)));
    return;
  }
  if (input.paused) return;
  const lab::Bytes bytes = event.getConstMessage()->bytes;
  const Time arrived = time_of(event.getReceiptTime());
  if (sensor == Sensor::lidar && !point_time_) {
    search_point_time(type, bytes, arrived);
  } else {
    take(sensor, type, bytes, arrived);
  }
}

void SensorInputs::take(Sensor sensor, const std::string& type, lab::Bytes bytes, Time arrived) {
  Input& input = inputs_[static_cast<std::size_t>(sensor)];
  // Only the LiDAR's thread may look at what it has found out.
  const lab::PointTimeFormat point_time = sensor == Sensor::lidar && point_time_ ? *point_time_ : lab::PointTimeFormat{};
  std::optional<Measurement> measurement;
  {
    const std::lock_guard lock(input.mutex);
    measurement = input.intake.take(sensor, type, bytes, arrived, point_time);
    if (measurement) input.fault.clear();
  }
  if (measurement) {
    sink_(*std::move(measurement));
  } else {
    complain(input, input.intake.first_fault());
  }
}

// The first clouds wait until they have shown how their points' times are written.
void SensorInputs::search_point_time(const std::string& type, lab::Bytes bytes, Time arrived) {
  if (!search_ || held_.empty() || held_.back().type != type) {
    search_.emplace(type, lidar_rate_);
    held_.clear();
  }
  search_->look_at(bytes);
  held_.push_back({type, {bytes.begin(), bytes.end()}, arrived});
  if (!search_->has_enough() && !search_->has_only_small()) {
    if (held_.size() > most_pictures) held_.erase(held_.begin());
    return;
  }
  const auto found = search_->decide();
  std::vector<Held> clouds = std::exchange(held_, {});
  search_.reset();
  Input& input = inputs_[static_cast<std::size_t>(Sensor::lidar)];
  if (!found) {
    complain(input, fmt::format("{}; ~no_deskew takes each cloud at its stamp", found.reason()));
    return;
  }
  point_time_ = *found;
  ROS_INFO_STREAM("kilvo: lidar from " << input.topic << ", point time: " << point_time_->text());
  for (const Held& cloud : clouds) take(Sensor::lidar, cloud.type, cloud.bytes, cloud.arrived);
}

// Said when it is another one than before.
void SensorInputs::complain(Input& input, const std::string& fault) {
  const std::lock_guard lock(input.mutex);
  input.fault = fault;
  if (input.said == fault) return;
  input.said = fault;
  ROS_ERROR_STREAM("kilvo: " << input.topic << ": " << fault);
}

InputState SensorInputs::state(Sensor sensor) const {
  const Input& input = inputs_[static_cast<std::size_t>(sensor)];
  const std::lock_guard lock(input.mutex);
  return {input.topic, input.messages, input.last, input.intake.counts(), input.fault, input.paused};
}

}  // namespace kilvo::ros1
