// The legs: units and names of their joints, the URDF, and the IMU's mount on the link that they carry.
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/core.h>
#include <optional>
#include <set>
#include <utility>

#include "kilvo/math/decompositions.hpp"
#include "lab/doctor/examination.hpp"
#include "lab/doctor/leg_hypotheses.hpp"

namespace kilvo::lab {
namespace {

constexpr double least_explained = 0.5;
constexpr std::size_t calm_poses = 6;     // of which one is looked at: neighbours say the same
constexpr std::size_t least_still = 12;   // poses: longer than both feet of a walking robot stand
constexpr double least_step = 0.005;      // m, from one pose to the next: of a foot that does not stand
constexpr double much_better_legs = 0.6;  // of the cost that a hypothesis may leave

// Normal of a sole, towards the link that stands on it.
Eigen::Vector3d normal_of(const FootPose& foot) {
  if (foot.corners < 3) return Eigen::Vector3d::Zero();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (int i = 0; i < foot.corners; ++i) mean += foot.p[static_cast<std::size_t>(i)] / foot.corners;
  Eigen::Matrix3d S = Eigen::Matrix3d::Zero();
  for (int i = 0; i < foot.corners; ++i) {
    const Eigen::Vector3d d = foot.p[static_cast<std::size_t>(i)] - mean;
    S += d * d.transpose();
  }
  const Eigen::Vector3d n = Eigen::JacobiSVD<Eigen::Matrix3d>(S, Eigen::ComputeFullU).matrixU().col(2);
  return n.dot(mean) > 0 ? Eigen::Vector3d(-n) : n;
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return degrees(std::acos(std::clamp(a.normalized().dot(b.normalized()), -1.0, 1.0)));
}

bool mentions(const std::string& text, const std::string& word) {
  std::string lower;
  for (const char c : text) lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower.find(word) != std::string::npos || (lower.size() > 2 && lower[0] == word[0] && lower[1] == '_');
}

}  // namespace

double Examination::LegScore::cost() const { return 1 - std::max(explained, -1.0) + 0.5 * std::min(flatness, 20.0) / 20; }

std::vector<LegPose> Examination::legs_under(const LegHypothesis* hypothesis, double period) const {
  LegHypothesis both;
  if (hypothesis != nullptr) both = *hypothesis;
  if (leg_mend_ && hypothesis != &*leg_mend_) both = joined(*leg_mend_, both);
  return recorded_legs_.path(robot_, &both, period, nullptr);
}

// How far the soles are from flat on the ground while the robot stands still.
Examination::LegScore Examination::score_legs(const std::vector<LegPose>& path, double offset, bool any_mount) const {
  LegScore out;
  const std::vector<Turn> turns = leg_turns(path, turn_interval);
  const GyroPath gyro_path = gyro();
  const SO3 described = robot_.imu.T_link_imu.R.inverse();
  out.axes = described.matrix();
  out.offset = offset;
  if (turns.size() < 30) return out;
  out.explained = explained_by(turns, gyro_path, offset, out.axes);
  if (any_mount) {
    const TurnAgreement best = agree(turns, gyro_path, offset);
    if (best.explained > out.explained && best.axes.determinant() > 0) {
      out.explained = best.explained;
      out.axes = best.axes;
    }
  }
  std::vector<double> angles;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::size_t still = 0, n = 0;  // poses: since it stands still, and looked at
  std::optional<Eigen::Vector3d> before;
  for (const LegPose& pose : path) {
    if (!stepping_.bears(pose.t)) continue;
    const double t = pose.t + offset;
    const Eigen::Vector3d apart = pose.foot[1].p[0] - pose.foot[0].p[0], last = std::exchange(before, apart).value_or(apart);
    // A foot in the air is not flat, nor one that rolls from step to step.
    const bool calm =
        (apart - last).norm() < least_step && gyro_path.covers(t - 0.1, t + 0.1) && gyro_path.rate(t - 0.1, t + 0.1).norm() < 0.05;
    still = calm ? still + 1 : 0;
    if (still < least_still || still % calm_poses != 0) continue;
    const Eigen::Vector3d left = normal_of(pose.foot[0]), right = normal_of(pose.foot[1]);
    if (left.isZero() || right.isZero()) continue;
    angles.push_back(angle_between(left, right));
    sum += left + right;
    ++n;
  }
  if (n < 5) return out;
  const auto middle = angles.begin() + static_cast<std::ptrdiff_t>(angles.size() / 2);
  std::ranges::nth_element(angles, middle);
  out.flatness = *middle;
  if (any_mount) return out;
  // Against gravity of the same moments, roughly: the mean over the recording.
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const InertialSample& s : recorded_.imu) up += accel_axes_ * s.accel;
  out.flatness = std::max(out.flatness, 0.5 * angle_between(sum, out.axes.transpose() * up));
  return out;
}

void Examination::examine_length_units() {
  constexpr double no_robot = 3, near = 0.01;  // m
  if (Eigen::Vector3d& p = robot_.imu.T_link_imu.p; p.norm() > no_robot) {
    Finding f{Sensor::imu, "imu_mount_position", {}, "no robot is as large", {}, p.norm(), "m", {}, true};
    const LengthUnit unit = unit_of(p.norm(), near);
    f.text = fmt::format("the IMU's position of {:.0f} m on its link is in {}", p.norm(), unit.name);
    p *= unit.metres;
    f.remedy = fmt::format("imu.T_link_imu.p: {}", vector_text(p));
    f.changes = {{"imu.T_link_imu.p", vector_text(p)}};
    find(std::move(f));
  }
  double farthest = 0;
  for (auto& foot : robot_.feet) {
    for (const Eigen::Vector3d& corner : foot.sole) farthest = std::max(farthest, corner.norm());
  }
  constexpr double no_foot = 1, shortest_foot = 0.03;  // m
  if (farthest > no_foot) {
    const LengthUnit unit = unit_of(farthest, shortest_foot);
    for (auto& foot : robot_.feet) {
      for (Eigen::Vector3d& corner : foot.sole) corner *= unit.metres;
    }
    find({Sensor::legs,
          "sole_unit",
          fmt::format("a corner of the soles is {:.0f} m from its link: they are in {}", farthest, unit.name),
          "no foot is as long",
          "robot.feet: sole, in metres",
          farthest,
          "m",
          {{"robot.feet", feet_text(robot_.feet)}},
          true});
  }
}

bool Examination::examine_leg_names() {
  const auto& feet = robot_.feet;
  const bool swapped = mentions(feet[0].link, "right") && mentions(feet[1].link, "left");
  if (swapped) {
    std::swap(robot_.feet[0], robot_.feet[1]);
    std::swap(robot_.feet[0].name, robot_.feet[1].name);
    find({Sensor::legs,
          "feet_swapped",
          fmt::format("left and right foot are swapped in the configuration: left is {}, right is {}", feet[1].link, feet[0].link),
          "the names of the links",
          "robot.feet: exchange the links (and soles) of left and right",
          0,
          "",
          {{"robot.feet", feet_text(feet)}},
          true});
  }
  examine_length_units();
  constexpr double farthest = 9.5;  // rad: a joint whose encoder has counted a turn too many is within a turn and a half
  double largest = 0;
  std::size_t beyond = 0, count = 0;
  for (const LegSample& s : recorded_.legs) {
    for (const double q : s.position) {
      largest = std::max(largest, std::abs(q));
      beyond += std::abs(q) > farthest ? 1 : 0;
      ++count;
    }
  }
  if (count > 0 && beyond > count / 50) {
    leg_mend_ = degrees_hypothesis();
    find({Sensor::legs,
          "joint_unit",
          "the joint positions are in degrees, not in radians",
          fmt::format("{:.0f} % of them are beyond a turn and a half, the largest is {:.0f}",
                      100.0 * static_cast<double>(beyond) / static_cast<double>(count), largest),
          "the driver must publish radians",
          largest,
          "",
          {},
          true});
  }
  std::string why;
  if (recorded_legs_.path(robot_, nullptr, 0.2, &why).empty() && !find_other_names(why)) {
    find({Sensor::legs,
          "urdf",
          fmt::format("the messages of the legs do not fit the URDF: {}", why),
          fmt::format("the messages have {} joints", recorded_.joint_names.size()),
          "robot.urdf, or robot.locked_joints",
          0,
          "",
          {},
          true});
    return false;
  }
  return true;
}

void Examination::examine_legs() {
  if (recorded_.legs.size() < 100) return;
  if (robot_.legs.type != "joints") {
    check(Sensor::legs, "all", Check::Verdict::unknown, "messages of two feet: nothing to hold them against");
    return;
  }
  if (!examine_leg_names()) return;
  examine_locked_joints();
  if (!examine_fixed_joints()) return;
  stepping_ = stepping_of(legs_under(nullptr));
  if (!examine_joint_values()) return;
  examine_joint_speeds();
  if (!stepping_.walks()) {
    check(Sensor::legs, "mount of the IMU, joints, clock", Check::Verdict::unknown, "the feet do not pass each other often enough: walk");
    return;
  }
  leg_turns_ = leg_turns(legs_under(nullptr), turn_interval);
  legs_ = agreement(leg_turns_, robot_.imu.T_link_imu.R.inverse(), least_explained);
  // A clock that is off first: any joint looks wrong at another time.
  leg_offset_ = legs_.known ? legs_.offset : 0;
  if (find_leg_start() || try_leg_hypotheses() || try_standing_hypotheses() || try_acceleration_hypotheses()) {
    leg_turns_ = leg_turns(legs_under(nullptr), turn_interval);
    legs_ = agreement(leg_turns_, robot_.imu.T_link_imu.R.inverse(), least_explained);
  }
  if (!legs_.known && !feet_stand()) {
    const std::string turning = fmt::format("{:.0f} % of the legs' turning is that of the gyro at best", 100 * legs_.explained);
    if (way_contradicts_legs(turning) || acceleration_contradicts_legs(turning)) return;
    const std::string detail = turning + ": no walk, or slow or rough encoders";
    check(Sensor::legs, "mount of the IMU, joints, clock", Check::Verdict::unknown, detail);
    return;
  }
  if (!legs_turned() && lidar_way().empty())
    leg_acceleration_ = leg_acceleration(leg_mend_ ? &*leg_mend_ : nullptr, robot_.imu.T_link_imu.R, leg_offset_);
  if (!legs_turned() && !feet_stand()) {
    check(Sensor::legs, "mount of the IMU, clock", Check::Verdict::unknown,
          fmt::format("the robot turned by {:.2f} rad/s only, {:.2f} about one of its axes: walk and turn", legs_.turning, legs_.weakest));
  } else {
    examine_leg_rotation();
  }
  examine_leg_lengths();
}

bool Examination::legs_turned() const {
  constexpr double least_turning = 0.15, least_weakest = 0.04;  // rad/s
  return legs_.turning >= least_turning && legs_.weakest >= least_weakest;
}

bool Examination::try_leg_hypotheses() {
  constexpr double period = turn_interval - 1e-4;  // s: a pose at each end of a turn
  const std::vector<LegPose> as_described = legs_under(nullptr, period);
  const LegScore described = score_legs(as_described, leg_offset_, false), free = score_legs(as_described, leg_offset_, true);
  const double cost = std::min(described.cost(), free.cost());
  constexpr double well = 0.008;  // of a description that needs no other
  if (cost < well) return false;
  const LegHypothesis* best = nullptr;
  const double enough = std::min(much_better_legs * cost, cost - well);
  double least = enough;
  const double unexplained = 1 - std::max(described.explained, free.explained), flatness = std::min(described.flatness, free.flatness);
  LegScore score;
  std::vector<LegHypothesis> all = leg_hypotheses(recorded_legs_, robot_);
  // Among so many one fits a little by chance: it has to explain nearly all.
  constexpr double senseless = 0.15, makes_sense = 0.75;  // cost, share
  constexpr double clearly = 0.85;                        // of the cost that a change of more parts may leave
  const std::size_t plain = all.size();
  if (cost > senseless) {
    for (LegHypothesis& h : gross_leg_hypotheses(recorded_legs_, robot_)) all.push_back(std::move(h));
  }
  for (const LegHypothesis& h : all) {
    if (h.cause == "imu_link" && turns_with_link(h)) continue;
    const std::vector<LegPose> path = legs_under(&h, period);
    LegScore other = score_legs(path, 0, false);
    if (leg_offset_ != 0) {
      const LegScore late = score_legs(path, leg_offset_, false);
      if (late.cost() <= other.cost()) other = late;
    }
    // Of two that are about as good, the one that changes less.
    const double as_good = best == nullptr || h.parts == best->parts ? least : h.parts > best->parts ? clearly * least : least / clearly;
    if (other.cost() >= std::min(as_good, enough) ||
        other.explained < (static_cast<std::size_t>(&h - all.data()) < plain ? least_explained : makes_sense))
      continue;
    least = other.cost();
    best = &h;
    score = other;
  }
  if (best == nullptr) return false;
  const double by_turning = smaller_by(1 - score.explained, unexplained, independent_turns());
  constexpr double sole_sigma = 3;  // degrees: zeros of three joints, and a floor that is not even
  const double by_soles = (flatness * flatness - score.flatness * score.flatness) / (sole_sigma * sole_sigma);
  if (by_turning * std::abs(by_turning) + by_soles < std::pow(sure_among(all.size()), 2)) {
    seems_wrong(best->culprit) = true;
    return false;
  }
  Finding f{best->culprit, best->cause, best->name, {}, best->setting, 0, {}, {}, true};
  f.evidence = fmt::format(
      "{:.0f} % of the legs' turning is that of the gyro then, {:.0f} % as described; the soles are {:.1f} and {:.1f} degrees from flat",
      100 * score.explained, 100 * described.explained, score.flatness, described.flatness);
  find_on_legs(std::move(f), *best);
  return true;
}

}  // namespace kilvo::lab
