// Which foot is in contact: what is reported of it, and the interface of the methods (legs.contact).
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>

#include "kilvo/filter/state.hpp"
#include "kilvo/legs/ground.hpp"
#include "kilvo/legs/leg_kinematics.hpp"

namespace kilvo {

struct LegStep;

/// What is reported of both feet (left, right).
struct Contacts {
  Time t{};
  std::array<bool, 2> on = {true, true};
  std::array<double, 2> probability = {1, 1};         // of standing
  std::array<double, 2> load = {0.5, 0.5};            // share of the weight, while both stand
  bool flight = false;                                // the IMU measures free fall
  std::array<Time, 2> since{};                        // of the present phase of each
  std::array<double, 2> clearance = {0, 0};           // of the lowest point over the ground on which it stood last, m
  double d_a = 0;                                     // normalised deviation of the acceleration
  std::array<double, 2> d_fv = {0, 0};                // normalised deviation of the foot's velocity; above 10: it moves
  std::array<GroundPatch, 2> ground;                  // on which each stands or stood last
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // of the ground under the feet, in the world
  double sole_speed = 0;                              // of a supporting foot as it is seen, median, as learnt, m/s
  double fast_sole = 0;                               // five of six samples of it are slower, m/s
  double swing_speed = 0;                             // of a foot that swings, median, as learnt, m/s; 0: not known

  /// How long a foot has been on or off, s.
  double phase(std::size_t side) const { return to_seconds(t - since[side]); }
};

/// A method. ContactEstimator is ours; others serve comparisons and research (LegConfig::detector).
class ContactDetector {
 public:
  virtual ~ContactDetector() = default;

  /// `x`: the state at feet.t. `omega`, `accel`: bias-free rate (rad/s) and specific force (m/s^2) of the IMU. `sigma_v`: uncertainty of
  /// the state's velocity, m/s. `map`: where the ground is looked up, if there is one. Allocates nothing.
  virtual const Contacts& update(const Feet& feet, const State& x, const Eigen::Vector3d& omega, const Eigen::Vector3d& accel,
                                 double sigma_v = 0, const VoxelMap* map = nullptr) = 0;
  virtual const Contacts& contacts() const = 0;
  /// Forgets the feet, not the robot: after a gap in the legs' messages.
  virtual void restart() = 0;

  /// What the efforts of the joints imply is to be in Feet::force_I.
  virtual bool needs_forces() const { return false; }

  /// Whether the height of the feet over the ground counts in this sample, and how exactly the map knows it, m.
  struct Height {
    bool counts;
    double sigma;
  };
  /// The method's own view of the noise of a leg sample's rows (Eq. 8), where it has one. `x`: before the update; `gyro`: as measured,
  /// rad/s.
  virtual void adapt(LegStep&, const State&, const Eigen::Vector3d& /*gyro*/, const Height&) {}

  virtual std::unique_ptr<ContactDetector> clone() const = 0;
  /// Becomes what `other` is, which is of the same class. Allocates nothing.
  virtual void assign(const ContactDetector& other) = 0;
};

/// The part of the interface that is the same for every copyable method.
template <class Method>
class CopyableDetector : public ContactDetector {
 public:
  std::unique_ptr<ContactDetector> clone() const final { return std::make_unique<Method>(static_cast<const Method&>(*this)); }
  void assign(const ContactDetector& other) final { static_cast<Method&>(*this) = dynamic_cast<const Method&>(other); }
};

}  // namespace kilvo
