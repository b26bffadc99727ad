// Every number of the simulated sensors. Noise densities are per square root of Hz; sigma is one standard deviation.
#pragma once

#include <array>
#include <cstdint>

#include "kilvo/sensors/measurement.hpp"
#include "lab/simulation/biped.hpp"
#include "lab/simulation/sensor_errors.hpp"
#include "lab/simulation/wear_model.hpp"

namespace kilvo::lab {

/// How the messages of a sensor come.
struct Delivery {
  double rate = 0;     // Hz
  double latency = 0;  // s, from the measurement's end to its arrival
  double offset = 0;   // s, its clock says so much more than the true time
  double jitter = 0;   // s, sigma of the stamps
};

struct ImuModel {
  Delivery delivery{200, 0.0012};
  double gyro_noise = 2e-4, accel_noise = 1.5e-3;           // rad/s/sqrt(Hz), m/s^2/sqrt(Hz)
  double gyro_bias_sigma = 0.004, accel_bias_sigma = 0.04;  // rad/s, m/s^2: of the bias at the start
  double gyro_bias_walk = 2e-5, accel_bias_walk = 3e-4;     // rad/s/sqrt(s), m/s^2/sqrt(s)
  double gyro_range = 35, accel_range = 160;                // rad/s, m/s^2: saturation
};

struct JointModel {
  Delivery delivery{1000, 0.0006};
  double resolution = 9.587e-5;    // rad: 16 bits a turn
  double position_noise = 1.5e-4;  // rad, sigma
  double velocity_noise = 0.02;    // rad/s, sigma
  double offset_sigma = 5e-4;      // rad, of each joint's zero, constant
  double mass = 35;                // kg, of the robot: what the efforts carry
  double effort_noise = 0.5;       // N m, sigma
};

struct LidarModel {
  enum class Scan : std::uint8_t { rosette, lines_16, lines_64 };  // rosette: non-repetitive, as a Mid-360
  Delivery delivery{10, 0.004};
  Scan scan = Scan::rosette;
  int points = 20000;                      // per scan
  double range_noise = 0.02;               // m, sigma
  double angle_noise = 8e-4;               // rad, sigma, each of two directions
  double min_range = 0.1, max_range = 70;  // m; the farthest for a surface of reflectivity 0.8, less for darker and grazed ones
  double least_cosine = 0.04;              // of the incidence; what is grazed more gives no point
};

struct CameraModel {
  Delivery delivery{10, 0.018};
  int width = 640, height = 480;
  double fx = 341.3, fy = 341.3, cx = 321.4, cy = 238.1;           // pixels
  std::array<double, 4> distortion{-0.05, 0.02, 0.0004, -0.0003};  // k1 k2 p1 p2
  SE3 T_torso_camera = mount();
  double blur = 0.75;                           // pixels, sigma of the Gaussian that lens and pixel together blur like
  double exposure = 0.004;                      // s
  double gain = 230;                            // grey level of full reflectance = 255 * exposure * gain
  double exposure_swing = 0.25;                 // the exposure changes by up to this part of itself
  double exposure_period = 7;                   // s
  double read_noise = 1, photon_noise = 0.015;  // variance of a grey level I: read_noise^2 + photon_noise * I
  int blur_samples = 1;                         // within the exposure; 1: no motion blur
  double pixels_per_sample = 0;                 // above 0: as many more as the image turns by so much within the exposure, 8 at the most

 private:
  static SE3 mount();
};

struct SimulatorConfig {
  std::uint64_t seed = 1;
  double duration = 0;  // s; 0: until the walk ends
  BipedShape shape;     // as the URDF has it
  WearModel wear;
  SensorErrors errors;
  ImuModel imu;
  JointModel joints;
  LidarModel lidar;
  CameraModel camera;
  std::array<bool, sensor_count> use{true, true, true, true};  // by Sensor
  int threads = 1;                                             // 0: all cores; the measurements do not depend on it
};

}  // namespace kilvo::lab
