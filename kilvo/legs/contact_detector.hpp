// The contact estimation that legs.contact names, behind one interface.
#pragma once

#include <variant>

#include "kilvo/legs/contact_estimator.hpp"
#include "kilvo/legs/paper_contacts.hpp"
#include "kilvo/legs/simple_contacts.hpp"
#include "kilvo/legs/stance_tracker.hpp"

namespace kilvo {

class ContactDetector {
 public:
  /// Throws std::invalid_argument when config.contact names none.
  explicit ContactDetector(const LegConfig& config);

  /// See ContactEstimator::update. `sigma_v`: uncertainty of the velocity of x, m/s.
  const Contacts& update(const Feet& feet, const State& x, const Eigen::Vector3d& omega, const Eigen::Vector3d& accel, double sigma_v = 0,
                         const VoxelMap* map = nullptr);
  const Contacts& contacts() const;

  /// After a gap in the legs' messages, or when no foot could be used for long.
  void restart();

  /// The detector's own view of the noise of a leg sample's rows (Eq. 8), where it has one. `x`: before the update; `gyro`: as measured,
  /// rad/s. `ground`: whether the height of the feet counts.
  void adapt(LegStep& step, const State& x, const Eigen::Vector3d& gyro, StanceTracker::Ground ground);

 private:
  std::variant<ContactEstimator, PaperContactEstimator, VarianceContacts, ForceContacts> detector_;
  double ground_sigma_;  // m
};

}  // namespace kilvo
