// Two common methods of contact estimation, for comparison (the paper's Tables I and II): a threshold on the ground's force, and the
// variance of the acceleration. Selected by legs.contact: force, variance.
#pragma once

#include <array>

#include "kilvo/legs/contact_detector.hpp"

namespace kilvo::lab {

/// Time, clearance and phase, which every method reports alike.
class ContactReport {
 protected:
  /// Begins a sample; true when it is the first one.
  bool begin(const Feet& feet, const State& x);
  void set(std::size_t side, bool on);

  Contacts contacts_;
  std::array<Eigen::Vector3d, 2> lowest_;  // of each foot in the world, m
  bool started_ = false;
};

/// A foot is in contact while the force that the joints' efforts imply exceeds a share of the robot's weight. The weight is that of the
/// first half second. Without efforts both feet are taken as standing.
class ForceContacts final : public CopyableDetector<ForceContacts>, private ContactReport {
 public:
  const Contacts& contacts() const override { return contacts_; }
  void restart() override { started_ = false; }
  const Contacts& update(const Feet& feet, const State& x, const Eigen::Vector3d& omega, const Eigen::Vector3d& accel, double sigma_v = 0,
                         const VoxelMap* map = nullptr) override;
  bool needs_forces() const override { return true; }

 private:
  double weight_ = 0;  // N
  int samples_ = 0;
  Time since_{};
};

/// As HR2-KILO is described: when the acceleration's variance within a short window rises, a foot has come down; it is the one that was
/// higher over the ground within the last swing, and the other one leaves. Lift-offs are not seen; until the first impact both stand.
class VarianceContacts final : public CopyableDetector<VarianceContacts>, private ContactReport {
 public:
  const Contacts& contacts() const override { return contacts_; }
  void restart() override { started_ = false; }
  const Contacts& update(const Feet& feet, const State& x, const Eigen::Vector3d& omega, const Eigen::Vector3d& accel, double sigma_v = 0,
                         const VoxelMap* map = nullptr) override;

 private:
  static constexpr std::size_t window = 50;  // samples at most, of one millisecond at least
  std::array<double, window> norms_{};
  std::size_t count_ = 0;
  Time last_sample_{}, last_event_{};
  double usual_ = 0;                 // variance while it walks, (m/s^2)^2
  std::array<double, 2> highest_{};  // over the other foot since the last event, m
};

}  // namespace kilvo::lab
