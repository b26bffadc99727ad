// Settings of the estimator and of all that it conducts.
#pragma once

#include <string>
#include <tuple>

#include "kilvo/filter/predict.hpp"
#include "kilvo/filter/update_config.hpp"
#include "kilvo/legs/leg_config.hpp"
#include "kilvo/lidar/lidar_config.hpp"
#include "kilvo/map/visual_map.hpp"
#include "kilvo/map/voxel_map.hpp"
#include "kilvo/math/field.hpp"
#include "kilvo/vision/vision_config.hpp"

namespace kilvo {

struct InitialConfig {
  double still_time = 0.5;        // s
  double moving_start = 3.0;      // s
  double still_gyro = 0.03;       // rad/s
  double still_accel = 0.4;       // m/s^2
  double gravity_sigma = 0.05;    // m/s^2
  double gyro_bias_sigma = 5e-4;  // rad/s
  double velocity_sigma = 0.01;   // m/s

  static constexpr auto fields() {
    return std::tuple{
        Field{"still_time", &InitialConfig::still_time, "s", "how long the robot must stand still to start"},
        Field{"moving_start", &InitialConfig::moving_start, "s",
              "after so long without standing still it starts while moving, with a large covariance"},
        Field{"still_gyro", &InitialConfig::still_gyro, "rad/s", "standing still: standard deviation of the angular rate below this"},
        Field{"still_accel", &InitialConfig::still_accel, "m/s^2", "standing still: standard deviation of the acceleration below this"},
        Field{"gravity_sigma", &InitialConfig::gravity_sigma, "m/s^2",
              "standard deviation of the first gravity along each horizontal axis, from the accelerometer bias"},
        Field{"gyro_bias_sigma", &InitialConfig::gyro_bias_sigma, "rad/s", "uncertainty of the gyro bias measured at rest"},
        Field{"velocity_sigma", &InitialConfig::velocity_sigma, "m/s", "uncertainty of the velocity at rest"}};
  }
};

struct EstimatorConfig {
  double max_wait = 0.2;       // s
  double max_imu_gap = 0.025;  // s
  double smooth_time = 0.5;    // s
  bool wait_for_images = true;
  bool gravity_align = true;
  std::string settling = "legs";  // legs | none
  int threads = 1;
  bool sweep_points = true;    // outputs of sweeps carry their points; no setting: the program knows whether anything reads them
  bool sweep_updates = false;  // likewise, how they changed the estimate

  InitialConfig initial;
  ProcessNoise noise;
  UpdateConfig update;
  MapConfig map;
  LidarConfig lidar;
  VisionConfig vision;
  VisualMapConfig visual_map;
  LegConfig legs;

  static constexpr auto fields() {
    return std::tuple{
        Field{"max_wait", &EstimatorConfig::max_wait, "s", "how long earlier stamps are waited for, in data time; kilvo run: 1 if 0.2"},
        Field{"max_imu_gap", &EstimatorConfig::max_imu_gap, "s", "a longer gap between IMU samples is bridged with a large covariance"},
        Field{"wait_for_images", &EstimatorConfig::wait_for_images, "-",
              "outputs wait for images of earlier stamps; false (in the live runner): late images are fused when they come"},
        Field{"smooth_time", &EstimatorConfig::smooth_time, "s", "the smooth odometry takes two thirds of a correction in over this time"},
        Field{"gravity_align", &EstimatorConfig::gravity_align, "-", "z of the world is up; false: the world is the first IMU frame"},
        Field{"settling", &EstimatorConfig::settling, "-",
              "legs: legs that come back wait for a usual acceleration (paper, Section IV-E); none: they are used at once"},
        Field{"threads", &EstimatorConfig::threads, "-", "threads for sums over many points, 0: all cores; results do not depend on it"}};
  }
};

}  // namespace kilvo
