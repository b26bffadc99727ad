// The estimator: measurements in, states out. It never throws after construction, never prints, and knows no time but that of the data.
//
// A measurement goes through the InputQueue. IMU and leg samples go into the History at once (the asynchronous phase). Scans and images
// wait for the IMU, are registered by their pipelines at their own times, and the result becomes the base of the History (the sequential
// phase). SensorStatus decides which sensors carry the estimate.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "kilvo/estimator/findings.hpp"
#include "kilvo/estimator/frame_queue.hpp"
#include "kilvo/estimator/history.hpp"
#include "kilvo/estimator/imu_watch.hpp"
#include "kilvo/estimator/initialise.hpp"
#include "kilvo/estimator/moving_start.hpp"
#include "kilvo/estimator/output_queue.hpp"
#include "kilvo/estimator/sensor_status.hpp"
#include "kilvo/estimator/world_map.hpp"
#include "kilvo/input/input_queue.hpp"
#include "kilvo/legs/leg_pipeline.hpp"
#include "kilvo/vision/visual_pipeline.hpp"

namespace kilvo {

class LegKinematics;
class LivePropagator;

class Estimator {
 public:
  /// `used`: which sensors will be pushed, by Sensor; others are ignored and counted. Throws std::invalid_argument when a setting is
  /// invalid (its name is in the text).
  Estimator(const Robot& robot, const EstimatorConfig& config, std::array<bool, sensor_count> used);
  Estimator(Estimator&&) noexcept;
  Estimator& operator=(Estimator&&) noexcept;
  ~Estimator();

  /// Sweeps are registered to this map, in the estimator's world, and do not change it. Before any push.
  void give_map(VoxelMap map) { map_.give(std::move(map)); }

  /// Takes a measurement in the order of arrival; returns the new outputs in time order.
  std::vector<Output> push(Measurement m);
  /// The same, appended to `out`: with one vector used again the leg path allocates nothing.
  void push(Measurement m, std::vector<Output>& out);

  /// Sets a live propagator to the present state. False, and nothing is changed, before the start.
  bool fork(LivePropagator& into) const;

  /// No more measurements will come: what still waits is processed.
  std::vector<Output> finish();
  void finish(std::vector<Output>& out);

  /// Why leg messages like this one cannot be used with this robot; none: they can.
  std::optional<std::string> mismatch(const JointSample& s) const;

  const Statistics& statistics() const { return findings_.statistics(); }
  /// Events that no output has carried: after finish(), or before the first output.
  std::vector<Event> take_events() { return findings_.take_events(); }
  /// Of the messages as they have arrived until now.
  const Health& health() const { return input_.health(); }
  const VoxelMap& map() const { return map_.surfaces(); }
  bool initialised() const { return history_.has_begun(); }
  /// Of the outputs to come (Output::epoch).
  std::uint32_t epoch() const { return findings_.statistics().epochs - 1; }
  /// What it waits for before the first output; empty afterwards.
  std::string waiting_for() const { return initialised() ? std::string() : starter_.waiting_for(); }

 private:
  // What came through the queue, in the order of time.
  void handle(Measurement m, std::vector<Output>& out);
  void begin(const Start& start, std::vector<Output>& out);

  // The asynchronous phase.
  void process(ImuSample s, std::vector<Output>& out);
  void process(const JointSample& s, std::vector<Output>& out);

  // The sequential phase.
  void process(const LidarScan& scan, const FrameQueue::Frame& frame, std::vector<Output>& out);
  void process(const CameraImage& image, const FrameQueue::Frame& frame, std::vector<Output>& out);

  // What follows from either.
  void lose_imu(std::vector<Output>& out);
  void choose_modality(Time t);
  bool keep_plausible(bool definite = false);  // `definite`: looks at the whole covariance
  Findings::Situation situation() const;
  // What P lacks of the error relative to the first pose: errors of the map, of the LiDAR's mount and of the legs' description.
  PoseCovariance common_error(const State& x) const;
  void emit(const Estimate& e, std::vector<Output>& out, std::optional<Contacts> contacts = {}, double kinematic_us = 0,
            double contact_us = 0);

  EstimatorConfig config_;
  InputQueue input_;
  Starter starter_;
  ImuWatch imu_;
  History history_;
  std::unique_ptr<LegKinematics> kinematics_;
  LegPipeline legs_;
  LidarPipeline lidar_;
  std::optional<MovingStart> moving_start_;
  std::optional<VisualPipeline> vision_;
  WorldMap map_;
  FrameQueue frames_;
  SensorStatus status_;
  OutputQueue outputs_;
  Findings findings_;
};

}  // namespace kilvo
