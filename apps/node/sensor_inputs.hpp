// From messages as they arrive to measurements. A sensor may come late, stop and come back.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "lab/clocks/leg_clock.hpp"
#include "lab/clocks/sensor_clocks.hpp"
#include "lab/messages/point_time_search.hpp"
#include "lab/messages/sensor_intake.hpp"
#include "lab/settings/settings.hpp"

namespace kilvo::node {

using SteadyClock = std::chrono::steady_clock;

/// What has come of one sensor.
struct InputState {
  std::string topic;  // empty: not configured
  std::uint64_t messages = 0;
  std::optional<SteadyClock::time_point> last;  // when the newest came
  lab::SensorCounts counts;
  std::string fault;       // why its newest message cannot be used
  std::string connection;  // what keeps others' messages from coming at all
  bool paused = false;
  std::optional<double> clock;  // of the legs: found, and added to the times of arrival, s
  std::optional<double> moved;  // s, added to the stamps, which are of another clock than the IMU's
};

/// IMU and legs come on one thread, so that nothing keeps them waiting; clouds and images on another.
inline bool is_quick(Sensor sensor) { return sensor == Sensor::imu || sensor == Sensor::legs; }

/// One message as it came.
struct Arrived {
  std::string_view type;  // plain_type_name()
  lab::WireMessage message;
  Time at;  // by the computer's clock
};

class SensorInputs {
 public:
  using Sink = std::function<void(Measurement, Time arrived)>;
  using Say = std::function<void(const std::string&)>;

  /// `sink` is called by the threads that call receive(). `say`: for the user, a complaint or a finding.
  SensorInputs(const lab::Settings& settings, bool no_deskew, Sink sink, Say say);
  SensorInputs(const SensorInputs&) = delete;
  SensorInputs& operator=(const SensorInputs&) = delete;

  /// All messages of IMU and legs by one thread, of LiDAR and camera by one. `is_compressed`: from the camera's second topic.
  void receive(Sensor sensor, const Arrived& arrived, bool is_compressed = false);

  /// Why others' messages on the sensor's topic cannot come (a wrong type, a quality of service that does not fit); empty: they can.
  void note_connection(Sensor sensor, const std::string& fault);

  void pause(Sensor sensor, bool paused) { inputs_[static_cast<std::size_t>(sensor)].paused = paused; }
  InputState state(Sensor sensor) const;

 private:
  struct Held {  // a cloud, until it is known how its points' times are written
    std::string type;
    std::vector<std::uint8_t> bytes;
    lab::Encoding encoding;
    Time at;
  };
  struct Input {
    std::string topic;
    std::atomic<bool> paused{false};
    // Of the sensor's thread; read by others under its mutex.
    mutable std::mutex mutex;
    std::uint64_t messages = 0;
    std::optional<SteadyClock::time_point> last;
    std::optional<SteadyClock::time_point> raw_last;  // of the camera: uncompressed
    lab::SensorIntake intake;
    int findings = 0;            // of the intake, that the user was told
    bool drifts = false;         // so was that its clock does
    int clock_steps = 0;         // of its clock: that were reported
    std::string fault;           // of the newest message
    std::set<std::string> said;  // kinds of faults that the user was told, without their numbers
    std::string connection;
    std::optional<double> clock, moved;
  };

  bool note_arrival(Input& input, bool is_compressed);
  void take(Sensor sensor, const Arrived& arrived);
  bool give_time(Input& input, Measurement& measurement, Time arrived);
  bool bring_onto_imu_clock(Input& input, Measurement& measurement, Time arrived);
  void search_point_time(const Arrived& arrived);
  void complain(Input& input, const std::string& fault);
  void tell_once(Input& input, const std::string& text);
  Input& input_of(Sensor sensor) { return inputs_[static_cast<std::size_t>(sensor)]; }

  Sink sink_;
  Say say_;
  double lidar_rate_;
  lab::LegClock leg_clock_;  // of the thread of IMU and legs
  std::mutex clocks_mutex_;
  lab::SensorClocks clocks_;
  // Of the thread of clouds and images:
  std::optional<lab::PointTimeFormat> point_time_;
  std::optional<lab::PointTimeSearch> search_;
  std::vector<Held> held_;
  std::array<Input, sensor_count> inputs_;
};

}  // namespace kilvo::node
