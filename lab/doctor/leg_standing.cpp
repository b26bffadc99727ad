// Feet that stand, by the LiDAR's way: which description of the legs lets them.
#include <algorithm>
#include <fmt/core.h>
#include <numbers>

#include "kilvo/math/decompositions.hpp"
#include "lab/doctor/examination.hpp"
#include "lab/doctor/leg_hypotheses.hpp"

namespace kilvo::lab {
namespace {

// A description stands clearly better than another: factor, and seconds more.
constexpr double clearly = 1.3, least_standing = 2;
constexpr double still = 0.002;  // m, robust standard deviation, of soles that stand

}  // namespace

// The clock of the legs, or a mount of the IMU about the vertical, under which the feet stand as they do under no other description
// of the legs: from there the fit of the stances finds both. The turning alone does not tell them on soles that roll.
bool Examination::find_leg_start() {
  const LidarWay& way = lidar_way();
  // The turning of a robot that hardly turns agrees at other times as well.
  if (way.empty() || (legs_.known && legs_.agrees && legs_turned())) return false;
  const bool stand = feet_stand();
  if (stand && legs_.known && legs_.agrees) return false;
  const GyroPath path = gyro();
  const LegHypothesis* mend = leg_mend_ ? &*leg_mend_ : nullptr;
  const Standing described = standing_time(recorded_legs_, robot_, mend, way, path, 0);
  constexpr double enough = 0.1;  // of the time in which the robot moves: soles that seem to stand by chance do so for a hundredth of it
  if (stand && described.worth() > enough * described.moving) return false;
  const double longer = clearly * described.worth() + least_standing;
  LegStart start = longest_standing(recorded_legs_, robot_, mend, way, path, upright_mounts());
  if (start.standing.worth() < longer) {
    start = fitted_standing(recorded_legs_, robot_, mend, way, path, upright_mounts(), still);
    // Feet that stand by a fit, and do not as described, need not do so for much longer.
    const double no_chance = std::max(least_standing, enough * described.moving);
    if (start.standing.worth() < (stand ? longer : std::max(no_chance, described.worth()))) return false;
  }
  if (try_standing_hypotheses(start.standing.worth())) return true;
  leg_offset_ = start.offset;
  leg_start_ = start.R_link_imu;
  return true;
}

// Mounts under which gravity points from the hips to the feet, all around the vertical.
std::vector<SO3> Examination::upright_mounts() const {
  const SO3 described = robot_.imu.T_link_imu.R;
  Eigen::Vector3d up_link = up_by_legs(), force = Eigen::Vector3d::Zero();
  for (const InertialSample& s : recorded_.imu) force += accel_axes_ * s.accel;
  std::vector<SO3> out;
  if (!(up_link.norm() > 0 && force.norm() > 0)) return out;
  up_link.normalize();
  const SO3 upright = SO3::from_quaternion(Eigen::Quaterniond::FromTwoVectors(described * force, up_link)) * described;
  constexpr int mounts = 36;
  for (int k = 0; k < mounts; ++k) out.push_back(SO3::Exp(2 * std::numbers::pi * k / mounts * up_link) * upright);
  return out;
}

// Whatever turns as the gyro does may still not stand: joints of parallel axes exchanged, legs exchanged, soles on another link.
bool Examination::try_standing_hypotheses(double longer_than) {
  const LidarWay& way = lidar_way();
  if (way.empty()) return false;
  const GyroPath path = gyro();
  const auto stands = [&](const LegHypothesis* h) {
    LegHypothesis both = h != nullptr ? *h : LegHypothesis{};
    if (leg_mend_) both = joined(*leg_mend_, both);
    return standing_time(recorded_legs_, robot_, &both, way, path, leg_offset_);
  };
  const Standing described = stands(nullptr);
  struct Longest {
    const LegHypothesis* hypothesis = nullptr;
    Standing standing;
    double next = 0;  // s: worth of the second
  } best;
  double most = std::max(longer_than, clearly * described.worth() + least_standing);
  const auto longest_of = [&](const std::vector<LegHypothesis>& all, double longer) {
    Longest out;
    for (const LegHypothesis& h : all) {
      // The turning tells the link of the IMU better, if it tells anything.
      if (h.culprit != Sensor::legs && (legs_.known || turns_with_link(h))) continue;
      const Standing s = stands(&h);
      if (s.worth() > std::max(most, out.standing.worth()) && s.both() > longer) {
        out = {&h, s, std::max(out.next, out.standing.worth())};
      } else {
        out.next = std::max(out.next, s.worth());
      }
    }
    return out;
  };
  // Soles that stand that long leave no room for others that would stand clearly longer, but for those on links above the ankles.
  constexpr double well = 0.45, as_feet_do = 0.35, hardly = 0.1;  // of the time in which the robot moves
  const double longer = clearly * described.both();
  std::vector<LegHypothesis> plain, gross, sizes;
  if (described.worth() < well * described.moving) {
    plain = leg_hypotheses(recorded_legs_, robot_);
    best = longest_of(plain, longer);
    most = std::max(most, best.standing.worth());
  }
  // What one change explains needs no zero that is a quarter turn off.
  const bool hardly_stands = described.worth() < std::max(least_standing, hardly * described.moving);
  if (hardly_stands && best.standing.worth() <= as_feet_do * described.moving) {
    gross = gross_leg_hypotheses(recorded_legs_, robot_);
    // Among many that are far off one stands a little by chance, and others nearly as long: for a stance of each foot less.
    constexpr double stances = 1;  // s
    const Longest far = longest_of(gross, longer);
    const double next = std::max({far.next, best.standing.worth(), described.worth()});
    if (far.hypothesis != nullptr && far.standing.worth() > next + stances &&
        far.standing.worth() > std::min(as_feet_do * far.standing.moving, 2 * next + least_standing))
      best = far;
  }
  if (best.hypothesis == nullptr && described.worth() < least_standing) {
    sizes = size_hypotheses();
    best = longest_of(sizes, longer);
  }
  // A link above an ankle that hardly turns stands nearly as well, and on soft ground, in which no sole stands, better: only a link that
  // stands far better, and as feet do.
  std::vector<LegHypothesis> links;
  if (best.hypothesis == nullptr) {
    links = foot_link_hypotheses(recorded_legs_, robot_);
    best = longest_of(links, std::max(2 * described.both() + least_standing, as_feet_do * described.moving));
  }
  if (best.hypothesis == nullptr) return false;
  const LegHypothesis& h = *best.hypothesis;
  Finding f{h.culprit, h.cause, h.name, {}, h.setting, 0, {}, {}, true};
  f.evidence =
      fmt::format("by the LiDAR's way the soles stand for {:.1f} and {:.1f} s of the walk then, for {:.1f} and {:.1f} s as described",
                  best.standing.of[0], best.standing.of[1], described.of[0], described.of[1]);
  find_on_legs(std::move(f), h);
  return true;
}

// On soft ground soles turn under the robot, and their turning tells little; where they stand still tells.
bool Examination::feet_stand() const {
  const LidarWay& way = lidar_way();
  if (way.empty()) return false;
  constexpr double near = 0.35;  // rad, of a mount; another would not let them stand
  Robot start = robot_;
  if (leg_start_) start.imu.T_link_imu.R = *leg_start_;
  const StanceFit fit = fit_stances(recorded_legs_, start, leg_mend_ ? &*leg_mend_ : nullptr, way, gyro(), leg_offset_);
  return fit.good && fit.moved < still && (leg_start_ || (fit.R_link_imu * robot_.imu.T_link_imu.R.inverse()).Log().norm() < near);
}

// No change that was tried makes sense of them, and the other sensors agree.
void Examination::accuse_leg_joints(const std::string& evidence) {
  find({Sensor::legs,
        "leg_joints",
        "the joints of the legs do not move as the robot does, under none of the changes that were tried",
        evidence,
        "robot.urdf: axes, origins and zeros of the joints of the legs, or the URDF of this robot; their names and order in the driver",
        0,
        "",
        {},
        true});
}

// Soles that slip by so much of the way are no support.
bool Examination::is_no_way_of_legs(double scale, double sigma) {
  constexpr double most_slip = 0.15;  // of right legs on 50 walks, rough, running or slipping, up to 0.06
  return std::abs(scale - 1) > std::max(most_slip, sure * sigma);
}

}  // namespace kilvo::lab
