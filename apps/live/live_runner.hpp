// The estimator on a robot. A fast thread answers each IMU and leg sample at once; a slow thread runs the estimator with everything, and
// hands its state over after each sweep and image. A third one carries the outputs away.
// docs/decisions/live.md
#pragma once

#include <array>
#include <atomic>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "apps/live/backlog.hpp"
#include "apps/live/handover.hpp"
#include "apps/live/latency.hpp"
#include "apps/live/levelling.hpp"
#include "apps/live/raw.hpp"
#include "apps/live/ring.hpp"
#include "apps/live/signal.hpp"
#include "kilvo/estimator/estimator.hpp"
#include "lab/settings/live_config.hpp"

namespace kilvo::live {

struct LiveStatistics {
  Latency latency;                                    // of a leg or IMU sample: from push() to its output
  Latency correction;                                 // from the message that completed a sweep or image to the outputs that know of it
  std::uint64_t deadline_misses = 0;                  // latencies above a millisecond
  std::array<std::uint64_t, sensor_count> dropped{};  // by Sensor: oldest given up, because a thread fell behind
  std::uint64_t dropped_outputs = 0;                  // that nobody carried away in time
  std::map<std::string, std::size_t> deepest;         // queue -> most that waited in it
  std::map<std::string, double> cpu_seconds;          // thread -> time
  std::uint64_t clock_steps = 0;                      // the IMU's time stepped for good
  std::vector<std::string> warnings;
};

class LiveRunner {
 public:
  /// Each is called by the third thread, in time order by itself. `state`: of every leg sample, or IMU sample. `sweep`: of every sweep and
  /// image, and whatever has events, as the estimator gives them; their states are of the past. Once gravity is known both are in the level
  /// world (Output::R_LW), which one output of `sweep` reports as an event: docs/decisions/live.md.
  struct Sinks {
    std::function<void(Output)> state, sweep;
  };

  /// The estimator must outlive it and must not be touched before stop() has returned. Throws what LegKinematics throws.
  LiveRunner(Estimator& estimator, const Robot& robot, const EstimatorConfig& config, std::array<bool, sensor_count> used,
             const lab::LiveConfig& live, Sinks sinks);
  ~LiveRunner();
  LiveRunner(const LiveRunner&) = delete;
  LiveRunner& operator=(const LiveRunner&) = delete;

  /// From any thread. Never waits for the estimator.
  void push(Measurement m);

  /// All that has been pushed has been processed, and every output has been carried away.
  bool is_idle() const;

  /// What has been pushed is processed; then all threads end. More than once does nothing. Throws what a sink threw; it is not called
  /// again.
  void stop();
  /// A sink threw.
  bool failed() const { return failed_; }

  /// After stop().
  const LiveStatistics& statistics() const { return statistics_; }
  /// What the estimator said of the sensors, at most half a second ago. At any time.
  Statistics seen() const;
  /// What it waits for before the first output; empty afterwards.
  std::string waiting_for() const;

 private:
  struct Sample {
    bool is_imu = false;
    ImuSample imu;
    JointSample joints;
    Clock::time_point at;
  };
  struct Fork {
    LivePropagator runner;
    std::optional<Clock::time_point> corrected;  // when the message arrived that completed a sweep or image; none of others
    std::optional<SO3> R_LW;                     // the turn of the world from now on
  };

  void note_clock_steps(Time imu);
  // The fast thread.
  void run_fast();
  void take(const Sample& sample);
  void take_over();
  void emit(Clock::time_point since);
  // The slow thread.
  void run_slow();
  void answer(std::vector<Output>& outputs, Clock::time_point since);
  void keep_raw(const Measurement& m);
  bool level(std::vector<Output>& outputs);
  bool pass_on(std::vector<Output>& outputs);
  void hand_over(std::optional<Clock::time_point> corrected);
  void tell();
  // The third.
  void run_output();
  void carry(const std::function<void(Output)>& sink, Output output);
  void end();
  void warn(const std::string& text);

  Estimator& estimator_;
  std::array<bool, sensor_count> used_;
  lab::LiveConfig config_;
  Sinks sinks_;

  std::mutex pushing_;                                   // of those who push; the fast thread never asks for it
  std::array<std::uint64_t, sensor_count> not_taken_{};  // samples that the fast thread had no room for
  ClockSteps clock_steps_;                               // before both threads, so that they agree
  Backlog backlog_;
  Ring<Sample> samples_;
  Signal for_fast_, for_output_;
  Handover<Fork> forks_;
  Ring<Output> outputs_;
  std::mutex slow_outputs_mutex_;
  std::vector<Output> slow_outputs_;
  std::vector<Event> events_left_;  // of outputs that nobody carried away: they go with the next one
  std::uint64_t slow_outputs_dropped_ = 0;
  std::atomic<std::uint64_t> pushed_{0}, processed_{0};  // by the slow thread
  std::atomic<std::uint64_t> sweeps_out_{0}, sweeps_carried_{0};
  std::atomic<bool> input_ended_{false}, slow_ended_{false}, fast_ended_{false}, failed_{false};
  std::exception_ptr failure_;  // of a sink; read after its thread has ended

  // Of the fast thread:
  std::optional<LegKinematics> fast_kinematics_;
  RawSamples fast_raw_;
  std::uint64_t legs_heard_ = 0, legs_answered_ = 0;  // since the first output, while there is a pose
  Time newest_legs_ = Time::min();
  std::uint32_t epoch_ = 0;
  std::optional<Time> last_output_;
  bool lost_ = false;
  // Of the slow thread:
  std::optional<LegKinematics> slow_kinematics_;
  RawSamples slow_raw_;
  std::optional<Time> last_fork_;
  std::optional<Modality> last_modality_;
  bool gravity_align_;
  Levelling levelling_{Duration::max()};  // nothing waits for it
  std::uint32_t levelling_epoch_ = 0;
  Clock::time_point sweep_noise_{};

  mutable std::mutex seen_mutex_;  // and of the warnings and events
  Statistics seen_;
  std::vector<Event> own_events_;  // that no output has carried yet
  std::string waiting_for_;
  LiveStatistics statistics_;
  std::thread fast_, slow_, output_;  // last: they use all of the above
};

}  // namespace kilvo::live
