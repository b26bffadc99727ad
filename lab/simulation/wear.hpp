// The wear of a simulated robot, done to what its ideal sensors say. Each part draws from a generator of its own: one part alone is the
// same as among the others.
#pragma once

#include <array>
#include <vector>

#include "kilvo/sensors/measurement.hpp"
#include "lab/simulation/random.hpp"
#include "lab/simulation/walk.hpp"
#include "lab/simulation/wear_model.hpp"

namespace kilvo::lab {

/// The robot as it was built: thighs and shins of other lengths than the URDF says.
BipedShape built(BipedShape nominal, const WearModel& model, std::uint64_t seed);

/// The stages of a walk on soles that give way, with the impacts of the model.
std::vector<Stage> on_soft_soles(std::vector<Stage> stages, const WearModel& model);

/// How often a message comes: not at all, once, twice.
enum class Copies : std::uint8_t { none, one, two };

class Wear {
 public:
  Wear(const WearModel& model, const Walk& walk, std::uint64_t seed);

  /// What the encoders show beside the angles and velocities of the links, of samples in order of time. `efforts`: of the joints, N m.
  struct Encoders {
    JointAngles angle{}, velocity{};  // rad, rad/s
  };
  /// `velocities`: of the links, rad/s.
  Encoders encoders(double t, const JointAngles& velocities, const JointAngles& efforts);

  /// Of the IMU at a time, m/s^2.
  Eigen::Vector3d vibration(double t) const;

  /// Of the next message of this sensor.
  Copies copies(Sensor sensor);
  /// A joint stamp as it is written.
  Time joint_stamp(Time ideal);

 private:
  double slack(std::size_t joint, double effort, double dt);
  JointAngles shocks(double t);

  WearModel model_;
  const Walk& walk_;
  std::vector<double> touchdowns_[2];  // s, by Side
  Random shock_, jitter_;
  std::array<Random, 2> loss_;  // IMU, legs
  struct Tone {
    double frequency, phase;  // Hz, rad
  };
  std::array<std::array<Tone, 6>, 3> tones_;  // by axis
  double last_ = -1;                          // s
  JointAngles side_{}, flexed_{}, slow_{};    // within the play (-1 to 1), rad, rad/s
  Time last_stamp_{};
};

}  // namespace kilvo::lab
