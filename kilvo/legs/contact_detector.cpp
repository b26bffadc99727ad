#include "kilvo/legs/contact_detector.hpp"

#include <algorithm>
#include <stdexcept>

namespace kilvo {
namespace {

// Of a patch that the robot's own contacts span: it ties steps to each other, it is no absolute height, m.
constexpr double contact_patch_sigma = 0.01;

std::variant<ContactEstimator, PaperContactEstimator, VarianceContacts, ForceContacts> make(const LegConfig& config) {
  if (config.contact == "kilvo") return ContactEstimator(config);
  if (config.contact == "paper") return PaperContactEstimator();
  if (config.contact == "variance") return VarianceContacts();
  if (config.contact == "force") return ForceContacts();
  throw std::invalid_argument("legs.contact: '" + config.contact + "' is none of kilvo, paper, variance, force");
}

// r_c of Eq. 7: velocity and position in the world, height over the ground.
PaperContactEstimator::Residual residual_of(const Stance& foot, const GroundPatch& ground, const State& x, const Eigen::Vector3d& pc,
                                            const Eigen::Vector3d& gyro) {
  PaperContactEstimator::Residual r;
  r << foot_velocity(x, foot.point, gyro).r, foot_position(x, foot.point, pc).r, foot_height(ground, x, pc).r;
  return r;
}

}  // namespace

ContactDetector::ContactDetector(const LegConfig& config) : detector_(make(config)), ground_sigma_(config.ground_sigma) {}

const Contacts& ContactDetector::update(const Feet& feet, const State& x, const Eigen::Vector3d& omega, const Eigen::Vector3d& accel,
                                        double sigma_v, const VoxelMap* map) {
  if (auto* paper = std::get_if<PaperContactEstimator>(&detector_)) return paper->update(feet, x, omega, accel, map);
  if (auto* variance = std::get_if<VarianceContacts>(&detector_)) return variance->update(feet, x, accel);
  if (auto* force = std::get_if<ForceContacts>(&detector_)) return force->update(feet, x);
  return std::get<ContactEstimator>(detector_).update(feet, x, omega, accel, sigma_v, map);
}

const Contacts& ContactDetector::contacts() const {
  return std::visit([](const auto& d) -> const Contacts& { return d.contacts(); }, detector_);
}

void ContactDetector::restart() {
  std::visit([](auto& d) { d.restart(); }, detector_);
}

void ContactDetector::adapt(LegStep& step, const State& x, const Eigen::Vector3d& gyro, StanceTracker::Ground ground) {
  auto* paper = std::get_if<PaperContactEstimator>(&detector_);
  if (paper == nullptr) return;
  for (std::size_t side = 0; side < 2; ++side) {
    Stance& foot = step.foot[side];
    // A foot that carries though it is not believed to, because no other does, keeps its wide noise.
    if (!foot.used || !paper->contacts().on[side]) continue;
    const Eigen::Vector3d pc = foot.begins ? x.pose() * foot.point.p : Eigen::Vector3d(x.pc[side] + x.R * foot.shift);
    const auto r = residual_of(foot, paper->contacts().ground[side], x, pc, gyro);
    paper->learn(side, r);
    foot.row_scale = paper->row_scale(r);
    foot.variance_scale = 1;
    // Without a map, and where it is not known to be level, the ground is that of the earlier contacts (KI).
    const auto& patch = paper->contact_patch(side);
    if (!foot.begins || foot.ground || !patch || ground != StanceTracker::Ground::use) continue;
    foot.ground = patch;
    foot.ground->sigma = std::hypot(std::max(patch->sigma, contact_patch_sigma), ground_sigma_);
  }
}

}  // namespace kilvo
