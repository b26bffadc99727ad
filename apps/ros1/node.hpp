// The node: what comes on the topics goes through the live runner, what it says goes out.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <ros/node_handle.h>
#include <shared_mutex>
#include <string>
#include <vector>

#include "apps/live/live_runner.hpp"
#include "apps/ros1/diagnostics.hpp"
#include "apps/ros1/map_thread.hpp"
#include "apps/ros1/master_watch.hpp"
#include "apps/ros1/parameters.hpp"
#include "apps/ros1/sensor_inputs.hpp"
#include "apps/ros1/state_outlet.hpp"

namespace kilvo::ros1 {

class Node {
 public:
  /// Throws lab::ConfigError when the settings make no sense together.
  Node(const Parameters& parameters, const lab::Settings& settings);
  ~Node() { stop(); }
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  /// What goes out at a leisurely pace; to be called about ten times a second.
  void tick();

  /// Takes no more messages; what has come is worked on, and published, first.
  void stop();

 private:
  /// One life of the estimator, from its start to a reset.
  struct Life {
    Life(const lab::Settings& settings, live::LiveRunner::Sinks sinks);
    Estimator estimator;
    live::LiveRunner runner;
  };

  std::unique_ptr<Life> begin_life();
  void end_life();
  void push(Measurement m);
  bool is_of_this_robot(const JointSample& sample);
  Condition condition();
  void offer_services();
  bool save_map(TriggerAnswer& answer);
  bool reset(TriggerAnswer& answer);
  bool pause(Sensor sensor, bool paused, SetBoolAnswer& answer);

  Parameters parameters_;
  lab::Settings settings_;
  StateOutlet states_;
  MapThread map_;
  std::optional<LegKinematics> kinematics_;  // of the thread of IMU and legs

  mutable std::shared_mutex life_mutex_;  // exclusive while one life ends and the next begins
  std::unique_ptr<Life> life_;
  mutable std::mutex mismatch_mutex_;
  std::string legs_mismatch_;

  // Of the thread that ticks:
  std::optional<MasterWatch> master_;
  std::string last_essence_;
  SteadyClock::time_point last_diagnostics_{};
  std::string last_waiting_;

  ros::Publisher diagnostics_;
  std::vector<ros::ServiceServer> services_;
  std::unique_ptr<SensorInputs> inputs_;
  ros::CallbackQueue service_queue_;
  std::unique_ptr<ros::AsyncSpinner> service_spinner_;
};

}  // namespace kilvo::ros1
