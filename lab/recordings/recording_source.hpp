// A recording as a MeasurementSource: the chosen topics, decoded, in the order in which they were recorded.
#pragma once

#include <array>
#include <deque>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "kilvo/sensors/measurement_source.hpp"
#include "lab/clocks/leg_clock.hpp"
#include "lab/clocks/sensor_clocks.hpp"
#include "lab/messages/point_time.hpp"
#include "lab/messages/sensor_intake.hpp"
#include "lab/recordings/recording_reader.hpp"
#include "lab/recordings/topic_choice.hpp"

namespace kilvo::lab {

/// What is wanted of one sensor.
struct SensorInput {
  bool use = false;
  std::string topic;       // `/camera/image_raw` means its `/compressed` too
  double rate = 0;         // Hz, nominal; 0: unknown. Of the LiDAR it helps to tell the unit of the point times
  double time_offset = 0;  // s, added to the stamps (of a scan: to the time that its points count from)
  Eigen::Vector3d gyro_scale = Eigen::Vector3d::Ones();  // of each axis of an IMU
  bool with_velocities = true;                           // of the joints: those in the messages are used
  JointNames joints = {};                                // that a leg sample must have; messages with a part of them are joined
};

struct RecordingOptions {
  std::array<SensorInput, sensor_count> sensors;
  bool no_deskew = false;                                     // take every cloud at its stamp; needs no point times
  bool with_colours = true;                                   // images are to give colours to the points that they show
  double start = 0;                                           // s from the beginning of the recording
  double duration = std::numeric_limits<double>::infinity();  // s

  std::optional<LegClock> leg_clock;  // puts the leg samples onto the IMU's clock

  SensorInput& operator[](Sensor s) { return sensors[static_cast<std::size_t>(s)]; }
  const SensorInput& operator[](Sensor s) const { return sensors[static_cast<std::size_t>(s)]; }
};

class RecordingSource final : public MeasurementSource {
 public:
  /// Throws InputError: no such recording, a used sensor without a topic or with one of a wrong type, clouds without point times.
  RecordingSource(const std::filesystem::path& input, RecordingOptions options) : RecordingSource(std::vector{input}, std::move(options)) {}
  /// Several recordings as one.
  RecordingSource(const std::vector<std::filesystem::path>& inputs, RecordingOptions options);

  std::optional<Measurement> next() override;

  /// When the measurement that next() gave last was recorded.
  Time recorded() const { return recorded_; }

  /// Over the whole file: time of the first recorded message, and from there to the last.
  Time begin() const { return reader_->begin(); }
  Duration duration() const { return reader_->end() - reader_->begin(); }
  double progress() const { return reader_->progress(); }  // 0 to 1

  /// Empty when the sensor is not used.
  const std::string& topic(Sensor s) const { return chosen_[static_cast<std::size_t>(s)].topic; }
  /// How the points' times were found to be written, for the user to read.
  const PointTimeFormat& point_time() const { return point_time_; }
  bool is_without_deskew() const { return options_.no_deskew; }
  std::string point_time_text() const { return options_.no_deskew ? "each cloud taken at its stamp" : "point time: " + point_time_.text(); }

  /// Which sensors stamp by another clock than the IMU.
  const SensorClocks& clocks() const { return clocks_; }
  /// Of the messages within [start, start + duration).
  const SensorCounts& counts(Sensor s) const { return intakes_[static_cast<std::size_t>(s)].counts(); }
  bool input_damaged() const { return reader_->damage().has_value(); }
  std::optional<Damage> damage() const { return reader_->damage(); }
  /// What the user should know, one sentence each; complete when next() has given nothing.
  std::vector<std::string> warnings() const;

 private:
  struct Held {
    Measurement measurement;
    Time recorded;
  };
  std::optional<Measurement> decode(Sensor sensor, const RawMessage& message);
  std::optional<Measurement> read();

  std::unique_ptr<RecordingReader> reader_;
  RecordingOptions options_;
  std::array<ChosenTopic, sensor_count> chosen_;
  PointTimeFormat point_time_;
  std::array<SensorIntake, sensor_count> intakes_;
  std::optional<RawMessage> message_;  // read last
  std::size_t next_sensor_ = 0;        // that it has not been decoded for
  Time recorded_{};                    // of the measurement that was given last
  SensorClocks clocks_;
  std::deque<Held> held_;  // read, in this order; until the clocks of all sensors that spoke are known
};

/// Looks at the first clouds of a LiDAR topic. Afterwards the reader must be given its selection again. Throws InputError, naming the
/// topic and its fields, when the clouds do not say when their points were measured; nothing is found when there are no clouds at all.
std::optional<PointTimeFormat> find_point_time(RecordingReader& reader, const ChosenTopic& lidar, double nominal_rate);

}  // namespace kilvo::lab
