// Where the IMU sits on the robot: turned on its link, on another link, higher or lower.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "lab/doctor/examination.hpp"
#include "lab/doctor/leg_hypotheses.hpp"

namespace kilvo::lab {
namespace {

constexpr double link_height_tolerance = 0.014;  // m

}  // namespace

// The IMU sits turned against the description: on another link of the URDF, the wrong way round, or just so. `measured`: R_link_imu.
void Examination::settle_imu_link(const SO3& measured) {
  const SO3 described = robot_.imu.T_link_imu.R;
  const double angle = degrees((measured * described.inverse()).Log().norm());
  Finding f;
  f.sensor = Sensor::imu;
  f.cause = "imu_mount_rotation";
  if (degrees((measured * described).Log().norm()) < 0.15 * angle + 1) {
    f.text = "the IMU's mount on the robot is given the wrong way round";
    const SE3 inverse = robot_.imu.T_link_imu.inverse();
    robot_.imu.T_link_imu = {measured, inverse.p};
    f.changes.push_back({"imu.T_link_imu.p", vector_text(inverse.p)});
    find_rotation(std::move(f), described, inverse.R, "imu.T_link_imu.R");
    return;
  }
  const GyroPath path = gyro();
  std::string link;
  double best = legs_.explained - 0.05, nearest = 0.5 * angle;
  for (const std::string& name : link_names(robot_.urdf)) {
    if (name == robot_.imu.link) continue;
    LegHypothesis h;
    h.robot = [&name](Robot& r) { r.imu.link = name; };
    if (turns_with_link(h)) continue;
    const std::vector<Turn> turns = leg_turns(legs_under(&h), turn_interval);
    if (turns.size() < 30) continue;
    const double explained = explained_by(turns, path, leg_offset_, described.inverse().matrix());
    const MountFit fit = fit_mount(turns, path, described.inverse(), leg_offset_);
    const double off = degrees((fit.R * described).Log().norm());
    if (!fit.fit.good || explained < best || off > std::min(nearest, 2.5)) continue;
    nearest = off;
    link = name;
  }
  if (!link.empty()) {
    f.cause = "imu_link";
    f.text = fmt::format("the IMU turns with link {}, not with link {}", link, robot_.imu.link);
    f.evidence = fmt::format("its mount is {:.1f} degrees from the description on {}, {:.1f} on {}", nearest, link, angle, robot_.imu.link);
    f.remedy = fmt::format("imu.T_link_imu.link: {}", link);
    f.size = angle;
    f.unit = fmt::format("deg");
    f.changes = {{"imu.T_link_imu.link", link}};
    robot_.imu.link = link;
    find(std::move(f));
    return;
  }
  find_turned_imu(measured, {});
}

void Examination::find_turned_imu(const SO3& measured, const std::string& evidence) {
  const SO3 described = robot_.imu.T_link_imu.R;
  Finding f{Sensor::imu, "imu_mount_rotation", {}, evidence, {}, 0, {}, {}, true};
  f.text = fmt::format("the IMU is turned on its link {} by {} of the link against the description", robot_.imu.link,
                       turn_text(measured * described.inverse()));
  f.turn = (measured.inverse() * described).Log();
  robot_.imu.T_link_imu.R = measured;
  find_rotation(std::move(f), described, measured, "imu.T_link_imu.R");
}

// Another link that turns with this one would put the IMU at the right height: then the link is wrong, else the place on it.
std::string Examination::link_at_height(double height) const {
  const std::vector<LegPose> here = legs_under(nullptr);
  if (here.empty() || !translation_ || way_.empty()) return "";
  const Eigen::Vector3d up_I =
      robot_.lidar.T_imu_lidar.R * (way_.front().T_WL.R.inverse() * Eigen::Vector3d(-translation_->g_W.normalized()));
  const Eigen::Vector3d up = robot_.imu.T_link_imu.R * up_I;
  for (const std::string& name : link_names(robot_.urdf)) {
    if (name == robot_.imu.link) continue;
    LegHypothesis h;
    h.robot = [&name](Robot& r) { r.imu.link = name; };
    const std::vector<LegPose> there = legs_under(&h);
    if (there.size() != here.size()) continue;
    const auto same = [&](std::size_t i) {
      const FootPose &a = here[i].foot[0], &b = there[i].foot[0];
      const double moved = up.dot(b.p[0] - a.p[0]);
      // Nobody takes a hand for the trunk.
      constexpr double beside = 0.05;  // m
      if ((b.p[0] - a.p[0] - moved * up).norm() > beside) return false;
      // Feet that lie higher in the link's frame let the LiDAR stand lower.
      return (b.R_IF.inverse() * a.R_IF).Log().norm() < 0.02 && std::abs(height - moved) < link_height_tolerance;
    };
    if (same(0) && same(here.size() / 2) && same(here.size() - 1)) return name;
  }
  return "";
}

// How far both soles are above the origins of their links, if they are: the sign of their height is wrong.
std::optional<double> Examination::soles_above_ankles() const {
  const std::vector<LegPose> path = legs_under(nullptr, 1);
  if (path.empty()) return std::nullopt;
  constexpr double clearly = 0.01;  // m
  double above = INFINITY;
  for (std::size_t f = 0; f < 2; ++f) {
    const auto& sole = robot_.feet[f].sole;
    if (sole.empty()) return std::nullopt;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& corner : sole) middle += corner / static_cast<double>(sole.size());
    above = std::min(above, up_by_legs().normalized().dot(path.front().foot[f].R_IF * middle));
  }
  return above > clearly ? std::optional(above) : std::nullopt;
}

void Examination::accuse_imu_place(double height) {
  Finding f{Sensor::imu, "imu_mount_position", {}, {}, {}, height, fmt::format("m"), {}, true};
  if (const auto above = soles_above_ankles()) {
    f.sensor = Sensor::legs;
    f.cause = "sole_height";
    f.text = fmt::format("the soles are {:.1f} cm above the origins of their links", 100 * *above);
    f.remedy = "robot.feet: sole: the sign of the heights of its corners";
    find(std::move(f));
    return;
  }
  f.text = fmt::format("the IMU sits {:.1f} cm {} on the robot than described", 100 * std::abs(height), height > 0 ? "lower" : "higher");
  f.remedy = "imu.T_link_imu.p, or its link";
  if (const std::string link = link_at_height(height); !link.empty()) {
    f.cause = "imu_link";
    f.text += fmt::format(": as if on link {} instead of {}", link, robot_.imu.link);
    f.remedy = fmt::format("imu.T_link_imu.link: {}", link);
    f.changes = {{"imu.T_link_imu.link", link}};
  }
  find(std::move(f));
}

}  // namespace kilvo::lab
