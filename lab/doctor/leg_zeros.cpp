// What is wrong with the legs themselves: zeros of the joints and where the feet are, by the stances; their lengths.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "lab/doctor/examination.hpp"
#include "lab/doctor/leg_hypotheses.hpp"

namespace kilvo::lab {

// A zero that is far off bends all that the fit finds towards it: the one joint with which the soles stand better, when its zero may
// be anything. The zero of one hip alone looks like half of it in each hip and a turned IMU: it is the zero where the turn disappears.
bool Examination::find_wrong_zero(const StanceFit& stances, const Robot& start) {
  constexpr double least = 4, least_predicted = 2;  // degrees
  constexpr double predicted_sigmas = 2;            // standard deviations
  constexpr double better = 0.95, no_worse = 1.01;  // of how far standing feet seem to move
  constexpr double turned = 2.5, turn_left = 0.33;  // degrees, share of it
  constexpr std::ptrdiff_t most = 2;                // joints
  if (std::ranges::count(diagnosis_.findings, "joint_offset", &Finding::cause) >= most) return false;
  const auto turn_of = [&](const StanceFit& fit) { return degrees((fit.R_link_imu * robot_.imu.T_link_imu.R.inverse()).Log().norm()); };
  std::optional<std::size_t> joint;
  StanceFit best = stances;
  double least_beyond = 0;
  for (std::size_t i = 0; i < stances.joints.size(); ++i) {
    const double predicted = std::abs(stances.zero_growth[i] * stances.zero[i]);
    if (degrees(predicted) < least_predicted || predicted < predicted_sigmas * std::abs(stances.zero_growth[i]) * stances.zero_sigma[i])
      continue;
    StanceFit free = fit_stances(recorded_legs_, start, leg_mend_ ? &*leg_mend_ : nullptr, lidar_way(), gyro(), stances.offset, {i, false});
    const double size = std::abs(free.good ? free.zero[i] : 0), cost = free.moved / stances.moved;
    if (degrees(size) < least || size < sure_among(stances.joints.size()) * free.zero_sigma[i]) continue;
    if (turn_of(free) > std::max(turned, turn_of(stances))) continue;
    const bool instead_of_turn = turn_of(stances) > turned && turn_of(free) < turn_left * turn_of(stances);
    const double beyond = cost - (instead_of_turn ? no_worse : better);
    if (beyond > least_beyond) continue;
    least_beyond = beyond;
    best = std::move(free);
    joint = i;
  }
  if (!joint) return false;
  const std::string& name = stances.joints[*joint];
  const double zero = best.zero[*joint];
  LegHypothesis mend;
  mend.position = [place = std::ranges::find(recorded_.joint_names, name) - recorded_.joint_names.begin(), zero](std::size_t i, double& q) {
    if (static_cast<std::ptrdiff_t>(i) == place) q += zero;
  };
  Finding f{Sensor::legs, "joint_offset", {}, {}, {}, -degrees(zero), "deg", {}, true};
  f.text = fmt::format("the zero of joint {} is off by {:.0f} degrees", name, -degrees(zero));
  f.evidence = fmt::format("soles that stand move by {:.2f} mm then, by {:.2f} as described; {:.1f} degrees, standard deviation {:.1f}",
                           1e3 * best.moved, 1e3 * stances.moved, -degrees(zero), degrees(best.zero_sigma[*joint]));
  f.remedy = fmt::format("the zero of joint {} in the driver, or its origin in robot.urdf", name);
  find_on_legs(std::move(f), mend);
  return true;
}

// Hips of another width: the feet are farther from or nearer to each other than described, which shows when the robot turns over them.
void Examination::examine_feet_apart(const Robot& start) {
  constexpr double tolerance = 0.05;  // m; careful descriptions of rough robots, whose soles turn on the ground, seem off by 3.7 cm
  const StanceFit fit =
      fit_stances(recorded_legs_, start, leg_mend_ ? &*leg_mend_ : nullptr, lidar_way(), gyro(), leg_offset_, {std::nullopt, true});
  Eigen::Index axis = 0;
  if (!fit.good || fit.apart.cwiseAbs().maxCoeff(&axis) < std::max(tolerance, sure_among(3) * fit.apart_sigma[axis])) return;
  const std::vector<LegPose> path = legs_under(nullptr, 1);
  if (path.empty()) return;
  const Eigen::Vector3d described = path.front().foot[0].p[0] - path.front().foot[1].p[0];
  // What would leave nearly nothing between the hips is no description, but soles that turn on the ground.
  constexpr double most_of_it = 0.5;
  if (2 * std::abs(fit.apart[axis]) > most_of_it * std::abs(described[axis])) return;
  const double farther = std::copysign(2 * fit.apart[axis], fit.apart[axis] * described[axis]);
  find({Sensor::legs,
        "leg_lengths",
        fmt::format("the feet are {:.0f} cm {} each other along the link's {} than the URDF says", 100 * std::abs(farther),
                    farther > 0 ? "farther from" : "nearer to", "xyz"[axis]),
        fmt::format("soles that stand move by {:.2f} mm then; each foot is {:.1f} cm off, standard deviation {:.1f}", 1e3 * fit.moved,
                    100 * fit.apart[axis], 100 * fit.apart_sigma[axis]),
        "robot.urdf: the origins of the hips, or the URDF of this robot",
        farther,
        "m",
        {},
        true});
}

void Examination::accuse_uneven_legs(double uneven) {
  const std::string longer = uneven > 0 ? "left" : "right", shorter = uneven > 0 ? "right" : "left";
  find({Sensor::legs,
        "leg_lengths",
        fmt::format("the {} leg of the URDF is too long, or the {} one too short, by {:.1f} cm", longer, shorter, 100 * std::abs(uneven)),
        fmt::format("where the robot stands the {} sole is {:.1f} cm lower than the other", longer, 100 * std::abs(uneven)),
        "robot.urdf: the lengths of thigh and shin of both legs, or the zeros of the joints",
        uneven,
        "m",
        {},
        true});
}

void Examination::accuse_leg_lengths(double scale, double height) {
  // The stances show mount and clock with legs of these lengths only.
  constexpr double by_lengths = 5, clock_by_lengths = 0.01;  // degrees, s
  std::erase_if(diagnosis_.findings, [](const Finding& f) {
    return (f.cause == "imu_mount_rotation" && f.size < by_lengths) || (f.cause == "legs_clock" && std::abs(f.size) < clock_by_lengths);
  });
  Finding f{Sensor::legs, "leg_lengths", {}, {}, {}, scale - 1, {}, {}, true};
  f.text = fmt::format("the legs of the URDF are too {}: the robot walks {:.1f} % {} by its legs than by the LiDAR and stands {:.1f} cm {}",
                       scale > 1 ? "long" : "short", 100 * std::abs(scale - 1), scale > 1 ? "farther" : "less far", 100 * std::abs(height),
                       height > 0 ? "higher" : "lower");
  f.remedy = "robot.urdf: the lengths of thigh and shin, or the URDF of this robot";
  if (scale < 0.4 || scale > 2.5) {
    f.cause = "urdf";
    f.text = fmt::format("the legs of the URDF are not those of this robot: by them it walks {:.2f} times as far as by the LiDAR", scale);
    f.remedy = "robot.urdf, or names, signs and zeros of the joints in the messages";
  }
  find(std::move(f));
}

// A zero that is wrong in both legs alike is a turn of the IMU, and counted as one: its standard deviation says so.
void Examination::refine_zeros(const StanceFit& stances) {
  stances_ = stances;
  constexpr double method = 0.25, largest = 0.5, scale_method = 0.002, largest_scale = 0.005;  // degrees, -
  for (std::size_t i = 0; i < stances.joints.size(); ++i) {
    refinements_.push_back(refinement(Sensor::legs, "zero of " + stances.joints[i], {degrees(stances.zero[i])},
                                      {degrees(stances.zero_sigma[i])}, method, largest, fmt::format("deg")));
  }
  refinements_.push_back(refinement(Sensor::legs, fmt::format("scale of the legs"), {stances.scale - 1}, {stances.scale_sigma},
                                    scale_method, largest_scale, fmt::format("-")));
}

}  // namespace kilvo::lab
