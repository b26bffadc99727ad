#include "kilvo/legs/contact_estimator.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo {
namespace {

constexpr double normal_time = 0.5;  // s, of the ground's normal

}  // namespace

void ContactEstimator::start(const Feet& feet, const State& x) {
  cues_.restart();
  filter_.restart();
  ground_.forget();
  contacts_.on = {true, true};
  contacts_.normal = -x.g.normalized();
  contacts_.t = feet.t;
  contacts_.since.fill(feet.t - std::chrono::seconds(1));
  started_ = true;
}

// A foot in single support, flat and at rest, has the orientation of the ground.
void ContactEstimator::follow_ground(const Feet& feet, const State& x, const std::array<FootMotion, 2>& motion, double dt) {
  for (std::size_t side = 0; side < 2; ++side) {
    const double alone = filter_.probabilities()[side == 0 ? ContactFilter::left : ContactFilter::right];
    if (alone < ContactFilter::sure_of_state || motion[side].speed > contacts_.fast_sole || motion[side].rolling > contacts_.fast_sole)
      continue;
    if (const auto normal = sole_normal(feet.foot[side], x, -x.g.normalized()))
      contacts_.normal = (contacts_.normal + std::min(1.0, dt / normal_time) * (*normal - contacts_.normal)).normalized();
  }
}

void ContactEstimator::report(const Feet& feet, const State& x, const std::array<FootMotion, 2>& motion, const VoxelMap* map) {
  const double unit = std::sqrt(standard_gravity * cues_.leg_length());
  contacts_.sole_speed = filter_.stance_speed() * unit;
  contacts_.fast_sole = filter_.fast_stance() * unit;
  contacts_.swing_speed = filter_.swing_speed() * unit;
  contacts_.flight = ContactFilter::is_probable(filter_.probabilities()[ContactFilter::none]);
  for (std::size_t side = 0; side < 2; ++side) {
    const bool stood = contacts_.on[side];
    contacts_.probability[side] = filter_.carries(side);
    contacts_.on[side] = ContactFilter::is_probable(contacts_.probability[side]);
    if (contacts_.on[side] != stood) contacts_.since[side] = feet.t;
    GroundPatch& ground = contacts_.ground[side];
    if (contacts_.on[side]) {
      // The ground is looked up at touchdown; through the point on which the foot stands, so that standing has no clearance.
      if (!stood) {
        ground_.stands_at(motion[side].lowest);
        if (const auto patch = ground_.under(map, motion[side].lowest, -x.g.normalized())) ground.normal = patch->normal;
      }
      ground.point = motion[side].lowest;
    }
    contacts_.clearance[side] = ground.height_of(motion[side].lowest);
    contacts_.d_fv[side] = unusual_deviation * motion[side].speed / (filter_.threshold_speed() * unit);
  }
}

const Contacts& ContactEstimator::update(const Feet& feet, const State& x, const Eigen::Vector3d& omega, const Eigen::Vector3d& accel,
                                         double sigma_v, const VoxelMap* map) {
  const Eigen::Vector3d up_W = -x.g.normalized();
  if (!started_) start(feet, x);
  const std::array<FootMotion, 2> motion = {motion_of(feet.foot[0], x, omega, up_W, contacts_.normal),
                                            motion_of(feet.foot[1], x, omega, up_W, contacts_.normal)};
  const double unit = std::sqrt(standard_gravity * std::max(0.1, cues_.leg_length()));
  const double threshold = filter_.threshold_speed() * unit;
  ContactCues cues = cues_.update(feet, x, motion, x.R * accel, threshold);
  // A velocity more uncertain than the threshold between stance and swing has little weight.
  cues.known_velocity = 1 / (1 + sigma_v * sigma_v / (threshold * threshold));
  filter_.update(cues);
  const double left = filter_.share_of_left(cues.force_side);
  contacts_.load = {left, 1 - left};
  contacts_.d_a = usual_acceleration_.deviation(accel, cues.dt);
  contacts_.t = feet.t;
  report(feet, x, motion, map);
  follow_ground(feet, x, motion, cues.dt);
  return contacts_;
}

}  // namespace kilvo
