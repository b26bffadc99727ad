// Feet that stand, by the LiDAR's way: which description of the legs lets them.
#include <algorithm>
#include <fmt/core.h>

#include "lab/doctor/examination.hpp"
#include "lab/doctor/leg_hypotheses.hpp"

namespace kilvo::lab {

// Whatever turns as the gyro does may still not stand: joints of parallel axes exchanged, legs exchanged, soles on another link.
bool Examination::try_standing_hypotheses() {
  const LidarWay way = lidar_way();
  if (way.empty()) return false;
  const GyroPath path = gyro();
  const auto stands = [&](const LegHypothesis* h) {
    LegHypothesis both = h != nullptr ? *h : LegHypothesis{};
    if (leg_mend_) both = joined(*leg_mend_, both);
    return standing_time(recorded_, robot_, &both, way, path, leg_offset_);
  };
  const auto worth = [](const std::array<double, 2>& s) { return s[0] + s[1]; };
  const std::array<double, 2> described = stands(nullptr);
  constexpr double clearly = 1.3, least = 2, balance = 0.4;  // -, s, -
  double most = clearly * worth(described) + least;
  std::vector<LegHypothesis> all = leg_hypotheses(recorded_, robot_);
  if (worth(described) < least) {
    for (LegHypothesis& h : gross_leg_hypotheses(recorded_, robot_)) all.push_back(std::move(h));
  }
  const std::size_t joints = all.size();
  // A link above an ankle that hardly turns stands nearly as well: only a link that stands far better.
  for (LegHypothesis& h : foot_link_hypotheses(robot_)) all.push_back(std::move(h));
  const LegHypothesis* best = nullptr;
  std::array<double, 2> then{};
  for (const LegHypothesis& h : all) {
    if (static_cast<std::size_t>(&h - all.data()) == joints) {
      if (best != nullptr) break;
      most = 2 * worth(described) + least;
    }
    if (h.culprit != Sensor::legs) continue;
    const std::array<double, 2> s = stands(&h);
    if (worth(s) <= most || std::min(s[0], s[1]) < balance * std::max(s[0], s[1])) continue;
    most = worth(s);
    then = s;
    best = &h;
  }
  if (best == nullptr) return false;
  Finding f{best->culprit, best->cause, best->name, {}, best->setting, 0, {}, {}, true};
  f.evidence =
      fmt::format("by the LiDAR's way the soles stand for {:.1f} and {:.1f} s of the walk then, for {:.1f} and {:.1f} s as described",
                  then[0], then[1], described[0], described[1]);
  for (const auto& [key, value] : best->changes) f.changes.push_back({key, value});
  find(std::move(f));
  leg_mend_ = leg_mend_ ? joined(*leg_mend_, *best) : *best;
  return true;
}

// On soft ground soles turn under the robot, and their turning tells little; where they stand still tells.
bool Examination::feet_stand() const {
  const LidarWay way = lidar_way();
  if (way.empty()) return false;
  constexpr double still = 0.002, near = 0.09;  // m, rad
  const StanceFit fit = fit_stances(recorded_, robot_, leg_mend_ ? &*leg_mend_ : nullptr, way, gyro(), leg_offset_);
  return fit.good && fit.moved < still && (fit.R_link_imu * robot_.imu.T_link_imu.R.inverse()).Log().norm() < near;
}

}  // namespace kilvo::lab
