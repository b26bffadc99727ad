// Which foot stands on the ground, without force sensors, and how surely (paper, Section V; docs/decisions/contact.md: where this departs).
#pragma once

#include <Eigen/Core>
#include <array>

#include "kilvo/filter/state.hpp"
#include "kilvo/filter/stationarity.hpp"
#include "kilvo/legs/contact_cues.hpp"
#include "kilvo/legs/contact_detector.hpp"
#include "kilvo/legs/contact_filter.hpp"
#include "kilvo/legs/foot_motion.hpp"
#include "kilvo/legs/ground.hpp"
#include "kilvo/legs/leg_kinematics.hpp"

namespace kilvo {

class ContactEstimator final : public CopyableDetector<ContactEstimator> {
 public:
  const Contacts& update(const Feet& feet, const State& x, const Eigen::Vector3d& omega, const Eigen::Vector3d& accel, double sigma_v = 0,
                         const VoxelMap* map = nullptr) override;
  const Contacts& contacts() const override { return contacts_; }
  void restart() override { started_ = false; }

 private:
  void start(const Feet& feet, const State& x);
  void follow_ground(const Feet& feet, const State& x, const std::array<FootMotion, 2>& motion, double dt);
  void report(const Feet& feet, const State& x, const std::array<FootMotion, 2>& motion, const VoxelMap* map);

  Contacts contacts_;
  bool started_ = false;
  CueTracker cues_;
  ContactFilter filter_;
  GroundLookup ground_;
  UsualAcceleration usual_acceleration_;
};

}  // namespace kilvo
