// From the topics that the configuration names to measurements. A topic may come late, stop and come back: ROS connects by itself.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>
#include <string>
#include <vector>

#include "apps/ros1/any_message.hpp"
#include "lab/messages/point_time_search.hpp"
#include "lab/messages/sensor_intake.hpp"
#include "lab/settings/settings.hpp"

namespace kilvo::ros1 {

using SteadyClock = std::chrono::steady_clock;

/// What has come of one sensor.
struct InputState {
  std::string topic;  // empty: not configured
  std::uint64_t messages = 0;
  std::optional<SteadyClock::time_point> last;  // when the newest came
  lab::SensorCounts counts;
  std::string fault;  // why its messages cannot be used
  bool paused = false;
};

class SensorInputs {
 public:
  using Sink = std::function<void(Measurement)>;

  /// Subscribes the sensors that the settings have. The sink is called by two threads: one for IMU and legs, so that nothing keeps them
  /// waiting, one for clouds and images.
  SensorInputs(const lab::Settings& settings, bool no_deskew, Sink sink);
  ~SensorInputs() { stop(); }
  SensorInputs(const SensorInputs&) = delete;
  SensorInputs& operator=(const SensorInputs&) = delete;

  /// No call of the sink comes afterwards.
  void stop();

  void pause(Sensor sensor, bool paused) { inputs_[static_cast<std::size_t>(sensor)].paused = paused; }
  InputState state(Sensor sensor) const;

 private:
  using Event = ros::MessageEvent<const AnyMessage>;
  struct Held {  // a cloud, until it is known how its points' times are written
    std::string type;
    std::vector<std::uint8_t> bytes;
    Time arrived;
  };
  struct Input {
    std::string topic;
    ros::Subscriber subscriber, compressed;
    std::atomic<bool> paused{false};
    // Of the sensor's thread; read by others under its mutex.
    mutable std::mutex mutex;
    std::uint64_t messages = 0;
    std::optional<SteadyClock::time_point> last;
    std::optional<SteadyClock::time_point> raw_last;  // of the camera: uncompressed
    lab::SensorIntake intake;
    std::string fault;  // of the newest message
    std::string said;   // the last fault that the user was told
  };

  void subscribe(Sensor sensor, const lab::Settings& settings);
  void receive(Sensor sensor, bool is_compressed, const Event& event);
  void take(Sensor sensor, const std::string& type, lab::Bytes bytes, Time arrived);
  void search_point_time(const std::string& type, lab::Bytes bytes, Time arrived);
  void complain(Input& input, const std::string& fault);

  Sink sink_;
  double lidar_rate_;
  // Of the thread of clouds and images:
  std::optional<lab::PointTimeFormat> point_time_;
  std::optional<lab::PointTimeSearch> search_;
  std::vector<Held> held_;
  std::array<Input, sensor_count> inputs_;
  ros::NodeHandle node_;
  ros::CallbackQueue fast_queue_, slow_queue_;
  ros::AsyncSpinner fast_spinner_, slow_spinner_;
};

}  // namespace kilvo::ros1
