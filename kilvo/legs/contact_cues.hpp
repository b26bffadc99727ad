// The contact cues of a leg sample and the IMU, with the short memory that they need.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>

#include "kilvo/legs/contact_filter.hpp"
#include "kilvo/legs/foot_motion.hpp"
#include "kilvo/legs/leg_kinematics.hpp"

namespace kilvo {

/// Specific force drawn from the IMU to the ground, and sudden stops of a foot.
class CueTracker {
 public:
  /// `motion`: of both feet at feet.t; `force_W`: bias-free specific force in the world, m/s^2; `threshold`: speed between standing and
  /// swinging, m/s. The cues but for known_velocity.
  ContactCues update(const Feet& feet, const State& x, const std::array<FootMotion, 2>& motion, const Eigen::Vector3d& force_W,
                     double threshold);

  /// Height of the IMU over the lower sole when it was last seen, m.
  double leg_length() const { return leg_length_; }
  void restart();

 private:
  struct Sample {
    Time t{};
    double speed = 0, vertical = 0;
  };
  class Stop {
   public:
    bool add(const Sample& s, double threshold);
    void clear() { count_ = 0; }

   private:
    static constexpr std::size_t most = 64;
    std::array<Sample, most> samples_{};
    std::size_t count_ = 0;
  };

  double side_of_force(const Feet& feet, const State& x) const;

  std::optional<Time> last_;
  double leg_length_ = 0;
  Eigen::Vector3d force_ = Eigen::Vector3d::Zero();  // smooth, m/s^2
  double load_ = 0;                                  // its norm, less smooth, m/s^2
  std::array<Stop, 2> stop_;
};

}  // namespace kilvo
