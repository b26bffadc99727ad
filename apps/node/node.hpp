// A node without its middleware: messages go through the live runner, and what it says goes to an outlet.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <string>
#include <vector>

#include "apps/live/live_runner.hpp"
#include "apps/node/base_frame.hpp"
#include "apps/node/diagnostics.hpp"
#include "apps/node/map_thread.hpp"
#include "apps/node/options.hpp"
#include "apps/node/outlet.hpp"
#include "apps/node/sensor_inputs.hpp"
#include "apps/node/state_publisher.hpp"
#include "lab/doctor/description_watch.hpp"

namespace kilvo::node {

/// What a service answers.
struct Answer {
  bool success = false;
  std::string message;
};

/// The settings of a node from those of its configuration file: as `kilvo run --realtime`, for on a robot the other cores are for others.
/// Throws lab::ConfigError when there is no IMU, or a key is missing.
lab::Settings load_settings(const std::string& config, const std::vector<std::string>& overrides);

class Node {
 public:
  /// Throws lab::ConfigError when the settings make no sense together. `say`: for the user; may be called by any thread.
  Node(const Options& options, const lab::Settings& settings, Outlet outlet, SensorInputs::Say say);
  ~Node() { stop(); }
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  /// Where the middleware puts what arrives.
  SensorInputs& inputs() { return inputs_; }
  const BaseFrame& base() const { return base_; }

  /// What goes out at a leisurely pace; to be called about ten times a second. `now`: by the computer's clock.
  void tick(Time now);

  /// Takes no more messages; what has come is worked on, and published, first. No receive() may be under way.
  void stop();

  // From any thread:
  Answer save_map();
  Answer reset();
  Answer pause(Sensor sensor, bool paused);
  /// Those that pause() makes sense for.
  std::vector<Sensor> sensors_to_pause() const;

 private:
  /// One life of the estimator, from its start to a reset.
  struct Life {
    Life(const lab::Settings& settings, live::LiveRunner::Sinks sinks);
    Estimator estimator;
    live::LiveRunner runner;
  };

  std::unique_ptr<Life> begin_life();
  void end_life();
  void push(Measurement m, Time arrived);
  bool is_of_this_robot(const JointSample& sample);
  Condition condition() const;

  Options options_;
  lab::Settings settings_;
  SensorInputs::Say say_;
  Outlet outlet_;
  BaseFrame base_;
  StatePublisher states_;
  MapThread map_;
  std::optional<LegKinematics> kinematics_;  // of the thread of IMU and legs
  lab::DescriptionWatch description_;

  mutable std::shared_mutex life_mutex_;  // exclusive while one life ends and the next begins
  std::unique_ptr<Life> life_;
  mutable std::mutex mismatch_mutex_;
  std::string legs_mismatch_;

  // Of the thread that ticks:
  std::string last_essence_;
  std::vector<lab::WrongDescription> wrong_;
  SteadyClock::time_point last_diagnostics_{};

  SensorInputs inputs_;  // last: it feeds all of the above
};

}  // namespace kilvo::node
