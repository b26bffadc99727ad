// A LiDAR: where each of its rays goes, when, and what comes back.
#pragma once

#include <functional>

#include "kilvo/math/deterministic_sum.hpp"
#include "kilvo/sensors/measurement.hpp"
#include "lab/simulation/simulator_config.hpp"
#include "lab/simulation/world.hpp"

namespace kilvo::lab {

/// Direction of ray `i` of a scan in the LiDAR frame; `t` is the ray's own time, `phase` turns the pattern (rad).
Eigen::Vector3d ray_direction(const LidarModel& model, int i, double t, double phase);

/// True when the robot's own body is in the way: torso, head mount and arms, in the torso frame.
bool hits_own_body(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);

class LidarSensor {
 public:
  LidarSensor(const SimulatorConfig& config, const World& world, double range_limit);

  /// Scan number `index`, begun at `begin` (s). `torso_at(t)`: pose of the torso in the world. The stamp is left to the caller.
  LidarScan scan(std::int64_t index, double begin, const std::function<SE3(double)>& torso_at, const Workers& workers) const;

 private:
  struct Ray {
    Eigen::Vector3d from, way;  // in the world
    std::uint64_t name;         // of what it draws
  };
  std::optional<Hit> echo(const Ray& ray) const;
  double range_of(const Ray& ray, const Hit& hit, double noise) const;

  const SimulatorConfig& config_;
  const World& world_;
  double max_range_;
  double phase_;
};

}  // namespace kilvo::lab
