// What the world gets: one for each leg sample while the legs are used, otherwise one for each IMU sample, each sweep and each image.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "kilvo/estimator/degradation.hpp"
#include "kilvo/estimator/event.hpp"
#include "kilvo/estimator/modality.hpp"
#include "kilvo/filter/state.hpp"
#include "kilvo/input/health.hpp"
#include "kilvo/legs/contact_estimator.hpp"
#include "kilvo/lidar/point_to_plane.hpp"
#include "kilvo/sensors/measurement.hpp"
#include "kilvo/vision/colours.hpp"

namespace kilvo {

/// Where the time of a sweep, or of an image, went. Measured, never decided upon.
struct StageTimes {
  double lidar_us = 0;   // undistortion to the end of the update
  double map_us = 0;     // insertion
  double other_us = 0;   // the rest of the sweep
  double visual_us = 0;  // of an image
};

/// How a sweep changed the estimate, and by what it was predicted (Replay::samples).
struct SweepUpdate {
  Estimate from, prior, posterior;
  std::vector<ImuSample> imu;
};

struct Output {
  Time t{};
  std::uint32_t epoch = 0;  // grows when the time went back and everything restarted: another world, another time
  State x;
  std::optional<SO3> R_LW;                          // the turn that has levelled the world (Levelling::apply); none: as it began
  std::optional<Eigen::Vector3d> vertical_W;        // settled by the legs (LevelGround): what the world is to be levelled by
  Covariance P = Covariance::Zero();                // of the error relative to the first pose (state.hpp: at)
  Eigen::Vector3d omega = Eigen::Vector3d::Zero();  // bias-free angular rate of the newest IMU sample, in the IMU frame, rad/s
  Modality modality = Modality::coast;
  Reason cause = Reason::start;       // of the last change of modality
  bool is_sweep = false;              // state after the last update of a sweep
  bool is_image = false;              // state after the update of an image
  std::optional<Contacts> contacts;   // of each leg sample
  double kinematic_us = 0;            // of a leg sample: kinematics, contacts, prediction and update
  double contact_us = 0;              // the contacts' part of it
  StageTimes stages;                  // of a sweep, of an image
  std::vector<Indicator> indicators;  // of a sweep, of an image
  std::vector<Event> events;          // that became true since the output before
  // Only of sweeps:
  std::vector<PointXYZI> points_W;  // undistorted, in the world; empty unless EstimatorConfig::sweep_points or a camera wants them
  RegistrationReport registration;
  std::shared_ptr<const SweepUpdate> update;  // where EstimatorConfig::sweep_updates wants it; none of sweeps that were searched for
  // Only of images:
  std::vector<ColouredPoint> coloured;  // points of the map that it sees, exposure-corrected
};

/// What happened to the measurements of one sensor.
struct SensorCount {
  std::uint64_t used = 0;
  std::map<std::string, std::uint64_t> dropped;  // cause -> messages
};

struct Statistics {
  std::array<SensorCount, sensor_count> sensors;   // by Sensor
  PointDrops points;                               // LiDAR points not used, by cause
  std::uint64_t lost_stances = 0;                  // on legs and IMU alone no stance foot was found for so long that the velocity was reset
  std::uint64_t unsupported = 0;                   // leg samples in which no foot stood, or stood still enough to be used
  std::uint64_t rollbacks = 0;                     // a non-finite state was discarded
  std::array<StreamHealth, sensor_count> health;   // by Sensor
  std::uint64_t imu_outages = 0;                   // the IMU was silent for so long that the pose was unknown
  std::array<double, sensor_count> clock_shift{};  // by Sensor: s, found to be missing from the stamps, and added since
  std::uint64_t clock_steps = 0;                   // the IMU's time stepped for good
  std::uint64_t searches = 0, found = 0;           // sweeps whose pose was searched for, and found
  std::uint64_t maps_begun_anew = 0;               // because sweeps had fitted nowhere for long
  std::uint32_t epochs = 1;                        // times that everything restarted, and one
  bool diverged = false;
  std::vector<Event> events;  // one for each sensor and reason, as it was last
};

/// The sentences of those events that are more than notices.
std::vector<std::string> warnings_of(const Statistics& statistics);

}  // namespace kilvo
