// What real sensors do to what ideal ones would say, and no description mentions. rough.cpp draws the sizes.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

namespace kilvo::lab {

struct ImuErrors {
  // Scale of each axis on the diagonal; beside it what the axes are off being at right angles, rad.
  Eigen::Matrix3d gyro = Eigen::Matrix3d::Identity(), accel = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d g_sensitivity = Eigen::Matrix3d::Zero();  // rad/s that the gyro shows per m/s^2: its masses are pulled too
  // By which the biases have moved once the board is warm, rad/s and m/s^2; it warms with this time constant, s.
  Eigen::Vector3d gyro_warming = Eigen::Vector3d::Zero(), accel_warming = Eigen::Vector3d::Zero();
  double warm_up = 120;

  /// How warm the board is, 0 to 1.
  double warmth(double t) const;
};

struct LidarErrors {
  double incidence_bias = 0;                 // m at 75 degrees: a grazed surface answers with a long echo, whose middle comes late
  double material_bias = 0;                  // m at the most, constant of each material: the strength of an echo shifts its threshold
  double least_sigma = 0, most_sigma = 0;    // m: a weaker echo, of a grazed or far surface, is noisier
  double tail = 0;                           // share of the ranges with five times that
  double dropout = 0;                        // share of the echoes that are lost
  double footprint = 0.15 * 0.017453292519;  // rad, width of the beam: at an edge it meets two surfaces,
  double mixed = 0;                          // and this share of such points lies somewhere between them
  double arms = 0;                           // share of all points that come from the robot's own forearms
  std::uint64_t seed = 0;                    // of the materials

  double sigma(double cosine, double range) const;
  double bias(double cosine, std::size_t material) const;
  /// How far the forearm is in that direction of the LiDAR frame, m.
  std::optional<double> arm(const Eigen::Vector3d& direction, double t) const;
};

struct CameraErrors {
  double vignetting = 0;           // share of the light that the lens takes away in the corners; it grows with the square of the radius
  double gamma = 1;                // grey levels grow with the light to the power of 1 / gamma: images are made for screens
  double white_balance = 0;        // red and blue drift by this share while the camera guesses the lamps' colour
  std::array<double, 2> phases{};  // rad, of those drifts
  double readout = 0;              // s from the first row to the last (rolling shutter); the stamp is that of the middle row

  /// Brightness of a pixel in red, green and blue, as a share of what comes in. `radius2`: squared distance from the middle, 1 in a corner.
  std::array<float, 3> tint(double t) const;
  float shade(double radius2) const { return static_cast<float>(1 - vignetting * radius2); }
  /// Grey level of a linear one, 0 to 255 both.
  float response(float linear) const;
};

/// Each is there or is ideal, to the byte.
struct SensorErrors {
  std::optional<ImuErrors> imu;
  std::optional<LidarErrors> lidar;
  std::optional<CameraErrors> camera;
  int objects = 0;  // of clutter beside the way: cartons, heaps of leaves, rods
};

}  // namespace kilvo::lab
