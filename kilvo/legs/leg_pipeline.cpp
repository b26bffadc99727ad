#include "kilvo/legs/leg_pipeline.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "kilvo/math/stopwatch.hpp"

namespace kilvo {
namespace {

// No foot of a robot that runs is off the ground for longer.
constexpr Duration longest_flight = std::chrono::milliseconds(500);

// Of a patch that the robot's own contacts span: it ties steps to each other, it is no absolute height, m.
constexpr double contact_patch_sigma = 0.01;

std::variant<ContactEstimator, PaperContactEstimator, VarianceContacts, ForceContacts> make(const LegConfig& config) {
  if (config.contact == "kilvo") return ContactEstimator();
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
    // A foot that is used without a detected contact, because no other has one, keeps its large noise.
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

LegPipeline::LegUpdate LegPipeline::measure(Feet feet, const Estimate& predicted, const ImuSample& imu, const VoxelMap* map,
                                            StanceTracker::Ground ground) {
  LegUpdate out;
  const bool on_legs_alone = ground == StanceTracker::Ground::use;
  if (always_height_) ground = StanceTracker::Ground::use;
  const Eigen::Matrix3d& M = motion_error_.matrix();
  for (FootPose& foot : feet.foot) {
    if (M.isZero(0)) break;
    for (std::size_t k = 0; k < static_cast<std::size_t>(foot.corners); ++k) {
      foot.p[k] -= M * foot.p[k];
      foot.v[k] -= M * foot.v[k];
    }
  }
  leg_length_ = std::max(leg_length_, feet.foot[0].p[0].norm());
  const State& x = predicted.x;
  const Eigen::Vector3d omega = imu.gyro - x.bg;
  const double sigma_v = std::sqrt(std::max(0.0, predicted.P.block<3, 3>(at::v, at::v).trace() / 3));
  Stopwatch watch;
  contacts_.update(feet, x, omega, imu.accel - x.ba, sigma_v, map);
  out.contact_us = watch.lap_us();
  for (std::size_t side = 0; side < 2; ++side) level_ground_.stands_at(side, x.pc[side]);
  out.step = stances_.step(feet, contacts_.contacts(), x, omega, sigma_v, {map, ground, on_legs_alone});
  if (has_level_ground_) find_level_ground(out.step, predicted, ground);
  contacts_.adapt(out.step, x, imu.gyro, ground);
  // As the filter sees it: the stance feet by their weights.
  Eigen::Vector3d velocity_I = Eigen::Vector3d::Zero();
  double weight = 0;
  for (const Stance& foot : out.step.foot) {
    if (!foot.used) continue;
    weight += 1 / foot.variance_scale;
    velocity_I -= (omega.cross(foot.point.p) + foot.point.v) / foot.variance_scale;
  }
  motion_error_.add(x, velocity_I / std::max(weight, 1e-9), weight, out.step.dt, on_legs_alone);
  return out;
}

// Where the map has no ground under a foot that comes down.
void LegPipeline::find_level_ground(LegStep& step, const Estimate& predicted, StanceTracker::Ground ground) {
  if (ground == StanceTracker::Ground::learn) return level_ground_.restart();
  for (std::size_t side = 0; side < 2; ++side) {
    Stance& foot = step.foot[side];
    if (!foot.begins) continue;
    const auto level = level_ground_.touchdown(side, predicted.x.pose() * foot.point.p, predicted);
    if (!level || foot.ground) continue;
    foot.ground = level;
    foot.level.reset();
  }
}

void LegPipeline::pose_is_measured(const Eigen::Matrix3d& unknown) {
  motion_error_.pose_is_measured(unknown);
  constexpr double mostly = 0.5;
  if (unknown(2, 2) < mostly) level_ground_.height_is_measured();
}

PoseCovariance LegPipeline::description_error(const State& x) const {
  PoseCovariance out = motion_error_.error(x);
  const Eigen::Vector3d up_W = -x.g.normalized();
  out.bottomRightCorner<3, 3>() += (level_ground_.stair_variance() + level_ground_.floor_variance()) * up_W * up_W.transpose();
  return out;
}

bool LegPipeline::has_lost_its_stance(const LegStep& step, bool on_legs_alone) {
  const bool carried = step.foot[0].used || step.foot[1].used;
  if (carried) last_used_stance_ = step.t;
  if (carried || !on_legs_alone) last_stance_ = step.t;
  if (step.t - last_stance_ < longest_flight) return false;
  restart();
  last_stance_ = step.t;
  return true;
}

bool LegPipeline::has_stood_lately(Time t) const { return t - last_used_stance_ < longest_flight; }

void LegPipeline::restart() {
  contacts_.restart();
  stances_.restart();
  level_ground_.restart();
}

}  // namespace kilvo
